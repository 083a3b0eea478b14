"""Maps over the parameters of a scene: a plan of points, what is observed at each, a store of the results."""
