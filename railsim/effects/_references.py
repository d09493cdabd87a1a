"""References that several effects share."""

BRUNI = (
    "Bruni, Vinolas, Berg, Polach, Stichel (2011), Modelling of suspension components in a rail vehicle dynamics "
    "context, Vehicle System Dynamics 49"
)
POLACH = "Polach (2005), Creep forces in simulations of traction vehicles running on adhesion limit, Wear 258"
INERTIAL = "IEEE Std 952-1997, single-axis interferometric fiber optic gyros: error terms"
