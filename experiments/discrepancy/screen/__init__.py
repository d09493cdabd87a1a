"""Screen: where the residual stands out, and which effects or forces take it away, before any is fitted."""
