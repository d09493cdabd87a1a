"""What the equations of motion say without a run: linearised equations, critical speed, energy."""
