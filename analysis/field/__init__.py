"""The base's field on its axis: model, fit to a scan, and what follows for the tops that float there."""
