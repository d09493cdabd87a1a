"""The reference engine: a multibody system in Exudyn, in absolute coordinates.

Rigid bodies with six coordinates each, Exudyn connectors for the linear suspension (large rotations included),
gravity as Exudyn loads, and one user function for contacts, nonlinear elements and what holds the vehicle to its
place along the track. The wheels' spins are coordinates of their own.
"""

import math
from collections.abc import Iterator
from typing import Any

import exudyn
import numpy as np
from exudyn import itemInterface as items  # noqa: N813
from scipy.spatial.transform import Rotation

from railsim.constants import GRAVITY
from railsim.dynamics.absolute_frames import track_frame
from railsim.dynamics.callback import bind_forces
from railsim.dynamics.channels import channel_names
from railsim.dynamics.equilibrium import initial_state, track_coordinates
from railsim.dynamics.guard import check_rows
from railsim.dynamics.observe_absolute import observe_all
from railsim.dynamics.plant import Plant, build_plant
from railsim.dynamics.stability import check_start, rail_rate
from railsim.dynamics.tables import wheel_load
from railsim.dynamics.workspace import absolute_workspace
from railsim.engines.interface import CHUNK, Diverged, Run
from railsim.model import Model

IMPLICIT_BELOW = 3.0  # m/s; creep damping is stiff as 1/V
TIME_TOLERANCE = 1e-9  # s
OVERLOAD = 2.0  # wheel load over the static one, up to which rails that move keep their margin of stability
EXPLICIT = 1.6  # largest product of step and rate of a rail on its contacts; classical Runge-Kutta is stable up to 2.78
INSTANT = 2.0**-23  # s; a step in which nothing moves


def integrate(run: Run) -> Iterator[np.ndarray]:
    """Rows of truth of a run, chunk by chunk; see `interface.Engine`.

    Raises
    ------
    Diverged : the solver fails, a state is not finite or a wheel left its rail; names time, place and body.
    """
    system = System(run)
    names = channel_names(run.model)
    first = 0
    while first < run.rows:
        last = min(first + CHUNK, run.rows)
        rows = system.advance(first, last, len(names))
        check_rows(rows, len(rows), names, run)
        yield rows
        first = last


class System:
    """The assembled multibody system of a run and its solver.

    Attributes
    ----------
    mbs : the Exudyn system; coordinates are 6 per body in the model's order, then the wheelsets' spin angles.
    """

    def __init__(self, run: Run) -> None:
        exudyn.config.printToConsole = False
        self.run = run
        self.plant = build_plant(run.model, run.track, run.speed)
        self._track = track_coordinates(self.plant)
        self._count = 6 * len(run.model.bodies) + len(run.model.wheelsets) + int(self.plant.core.states) + self._track
        self._memory = run.start + np.array([body.position[0] for body in run.model.bodies])
        self._work = absolute_workspace(len(run.model.bodies), len(run.model.free))
        self._container = exudyn.SystemContainer()
        self.mbs: Any = self._container.AddSystem()
        self._acceleration = np.zeros(self._count)
        self._finer = 1
        if self._track:  # explicit steps that follow the rails' contacts, which other engines take implicit
            rate = rail_rate(self.plant, OVERLOAD * wheel_load(run.model))
            self._finer = math.ceil(run.step * rate / EXPLICIT)
        self._assemble()

    def _assemble(self) -> None:
        model, mbs = self.run.model, self.mbs
        start = initial_state(self.plant, self.run)
        if self.run.speed.speed.min() >= IMPLICIT_BELOW:
            check_start(self.plant, self.run, start, self.run.step)
        positions, velocities = absolute_state(self.plant, model, start)
        nodes, numbers = [], []
        for b, body in enumerate(model.bodies):
            own = slice(6 * b, 6 * b + 6)
            nodes.append(
                mbs.AddNode(
                    items.NodeRigidBodyRxyz(initialCoordinates=positions[own], initialVelocities=velocities[own])
                )
            )
            inertia = [*body.inertia, 0.0, 0.0, 0.0]
            numbers.append(mbs.AddObject(items.ObjectRigidBody(mass=body.mass, inertia=inertia, nodeNumber=nodes[-1])))
            load = [0.0, 0.0, -body.mass * GRAVITY]
            marker = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=numbers[-1]))
            mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=load))
        # spins; states of elements are velocities of coordinates of unit mass
        masses = [*(wheelset.spin_inertia for wheelset in model.wheelsets), *([1.0] * int(self.plant.core.states))]
        for at, mass in enumerate(masses, 6 * len(model.bodies)):
            node = items.NodeGenericODE2(
                numberOfODE2Coordinates=1,
                referenceCoordinates=[0.0],
                initialCoordinates=[positions[at]],
                initialCoordinates_t=[velocities[at]],
            )
            nodes.append(mbs.AddNode(node))
            mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=nodes[-1:], massMatrix=[[mass]]))
        if self._track:
            own = slice(self._count - self._track, self._count)
            node = items.NodeGenericODE2(
                numberOfODE2Coordinates=self._track,
                referenceCoordinates=[0.0] * self._track,
                initialCoordinates=positions[own].tolist(),
                initialCoordinates_t=velocities[own].tolist(),
            )
            nodes.append(mbs.AddNode(node))
            mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=nodes[-1:], massMatrix=np.eye(self._track)))
        for element in model.elements:
            self._connect(element, numbers)
        contacts = items.ObjectGenericODE2(
            nodeNumbers=nodes, massMatrix=np.zeros((self._count,) * 2), forceUserFunction=self._user_function()
        )
        mbs.AddObject(contacts)
        kinds: Any = exudyn.OutputVariableType
        self._sensors = [
            [mbs.AddSensor(items.SensorNode(nodeNumber=n, storeInternal=True, outputVariableType=kind)) for n in nodes]
            for kind in (kinds.Coordinates, kinds.Coordinates_t, kinds.Coordinates_tt)
        ]
        mbs.Assemble()

    def _connect(self, element: Any, numbers: list[int]) -> None:
        """A linear element: marker 0 on the lower body, marker 1 on the upper one; the preload is an offset of the
        spring.
        """
        model = self.run.model
        markers = []
        for name in (element.lower, element.upper):
            index = model.index(name)
            local = np.subtract(element.position, model.bodies[index].position)
            markers.append(self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=numbers[index], localPosition=local)))
        preload = np.array([*element.preload, 0.0, 0.0, 0.0])
        offset = np.linalg.lstsq(element.stiffness, preload, rcond=None)[0]
        connector = items.ObjectConnectorRigidBodySpringDamper(
            markerNumbers=markers,
            stiffness=element.stiffness,
            damping=element.damping,
            offset=offset,
            useIntrinsicFormulation=True,
        )
        self.mbs.AddObject(connector)

    def _user_function(self) -> Any:
        """Generalised forces; called four times a step, so everything is bound beforehand."""
        plant, memory, work = self.plant, self._memory, self._work
        q, v, out = np.zeros(self._count), np.zeros(self._count), np.zeros(self._count)
        evaluate = bind_forces(plant, self.run.start, q, v, memory, work, out)

        def force(mbs: Any, t: float, item: int, coordinates: list[float], rates: list[float]) -> list[float]:
            del mbs, item
            q[:] = coordinates
            v[:] = rates
            evaluate(t)
            return out.tolist()

        return force

    def linearised(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M, C, K of Exudyn's own linearisation about the initial state, over the coordinates of `mbs`."""
        mass, stiffness, damping = self.mbs.ComputeLinearizedSystem()[:3]
        return mass, damping, stiffness

    def advance(self, first: int, last: int, columns: int) -> np.ndarray:
        """Rows `first` ... `last` - 1; the state stays at row `last` for the next call."""
        settings, kind = self._settings(first, last)
        memory = self._memory.copy()
        mbs = self.mbs
        if first == 0:
            self._acceleration = self._first_acceleration()
        else:
            current = mbs.systemData.GetSystemState(configuration=exudyn.ConfigurationType.Current)
            mbs.systemData.SetSystemState(current, configuration=exudyn.ConfigurationType.Initial)
        try:
            mbs.SolveDynamic(settings, solverType=kind)
        except exudyn.ExudynError as error:
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            reached = self._memory[self.run.model.index(self.run.model.reference)]
            place = f"between t = {first / self.run.rate:.3f} and {last / self.run.rate:.3f} s near s = {reached:.2f} m"
            raise Diverged(f"{self._restless()}: Exudyn's solver stopped {place}: {reason}") from None
        wanted = np.arange(first, last) / self.run.rate
        positions, velocities, accelerations = self._stores(np.arange(first, last + 1) / self.run.rate)
        accelerations[0] = self._acceleration  # Exudyn stores none at the start of a solution
        self._acceleration = accelerations[-1].copy()
        rows = np.zeros((last - first, columns))
        motion = positions[:-1], velocities[:-1], accelerations[:-1]
        observe_all(self.plant, wanted, *motion, memory, self._work, rows)
        return rows

    def _restless(self) -> str:
        """Name of the body that moves most against its speed of travel."""
        bodies = self.run.model.bodies
        velocities = np.array(self.mbs.systemData.GetODE2Coordinates_t())[: 6 * len(bodies)].reshape(-1, 6)
        return bodies[int(np.nan_to_num(np.abs(velocities[:, 1:]), nan=np.inf).max(axis=1).argmax())].name

    def _first_acceleration(self) -> np.ndarray:
        """Accelerations at time 0: those at the end of a step so short that nothing moves; the state stays as it is."""
        settings, _ = self._settings(0, 1)
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = 1, INSTANT
        settings.solution.sensors.writePeriod = INSTANT
        self.mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
        return self._stores(np.array([0.0, INSTANT]))[2][-1]

    def _stores(self, wanted: np.ndarray) -> list[np.ndarray]:
        """Coordinates, velocities and accelerations (times, coordinates) at `wanted` times [s]."""
        return [np.hstack([self._stored(s, wanted) for s in group]) for group in self._sensors]

    def _stored(self, sensor: int, wanted: np.ndarray) -> np.ndarray:
        data = np.atleast_2d(self.mbs.GetSensorStoredData(sensor))
        at = np.searchsorted(data[:, 0], wanted - TIME_TOLERANCE)
        if at[-1] >= len(data) or np.abs(data[at, 0] - wanted).max() > 1e-6:
            raise Diverged(
                f"Exudyn stored no state at t = {wanted[-1]:.4f} s; choose an output_rate that is a power of two"
            )
        return np.ascontiguousarray(data[at, 1:])

    def _settings(self, first: int, last: int) -> tuple[Any, Any]:
        run = self.run
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        steps = (last - first) * run.substeps * self._finer
        integration.startTime, integration.endTime = first / run.rate, last / run.rate
        integration.numberOfSteps = steps
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = (1.0 - 1e-6) / run.rate
        if run.speed.speed.min() >= IMPLICIT_BELOW:
            return settings, exudyn.DynamicSolverType.RK44
        integration.newton.useModifiedNewton = True
        return settings, exudyn.DynamicSolverType.TrapezoidalIndex2


def absolute_state(plant: Plant, model: Model, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Absolute coordinates and velocities from a state of the compiled engine."""
    n, w = len(plant.core.mass), len(plant.core.radius)
    frame = np.zeros(16)
    m, below = int(plant.core.states), track_coordinates(plant)
    s, speed, states = x[2 * n + 2 * w], x[2 * n + 2 * w + 1], x[2 * n + 2 * w + 2 :]
    positions, velocities = np.zeros((2, 6 * len(model.bodies) + w + m + below))
    for b, body in enumerate(model.bodies):
        small = np.array([x[j] if j >= 0 else 0.0 for j in plant.core.coordinate[b]])
        rates_small = np.array([x[n + j] if j >= 0 else 0.0 for j in plant.core.coordinate[b]])
        track_frame(plant, s + body.origin, frame)
        turn, origin, turning = frame[:9].reshape(3, 3), frame[9:12], speed * frame[12:15]
        arm = plant.core.local[b] + small[:3]
        own = slice(6 * b, 6 * b + 6)
        orientation = turn @ Rotation.from_euler("ZYX", small[:2:-1]).as_matrix()
        angles = Rotation.from_matrix(orientation).as_euler("XYZ")
        a, c = angles[0], angles[1]
        rates = np.array(
            [[1.0, 0.0, np.sin(c)], [0.0, np.cos(a), -np.sin(a) * np.cos(c)], [0.0, np.sin(a), np.cos(a) * np.cos(c)]]
        )
        positions[own] = [*(origin + turn @ arm), *angles]
        yaw, pitch = Rotation.from_euler("ZYX", [small[5], 0.0, 0.0]), Rotation.from_euler("ZYX", [*small[:3:-1], 0.0])
        roll_rate, pitch_rate, yaw_rate = rates_small[3:]
        relative = pitch.apply([roll_rate, 0.0, 0.0]) + yaw.apply([0.0, pitch_rate, 0.0]) + [0.0, 0.0, yaw_rate]
        velocity = np.array([speed, 0.0, 0.0]) + np.cross(turning, arm) + rates_small[:3]
        velocities[own] = [*(turn @ velocity), *np.linalg.solve(rates, turn @ (turning + relative))]
    positions[6 * len(model.bodies) :] = [*x[2 * n : 2 * n + w], *np.zeros(m), *states[m : m + below]]
    velocities[6 * len(model.bodies) :] = [
        *x[2 * n + w : 2 * n + 2 * w],
        *states[:m],
        *states[m + below : m + 2 * below],
    ]
    return positions, velocities
