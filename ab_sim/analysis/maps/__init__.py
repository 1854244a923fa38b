"""Maps: a verdict over two parameters of a scene, or over the angles at which balls start."""
