"""How the vehicle rides: comfort of those aboard, and whether it runs steadily."""
