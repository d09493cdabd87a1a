"""Pictures of measurements, truths and estimates in the house style; `.plot()` of each draws them."""
