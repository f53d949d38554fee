"""One file of scalar functions per texture kind, compiled together with a law.

Every sampler has the same four functions, the arguments of the texture at the end:

* ``height(x, y, ...)`` -> h
* ``slope(x, y, ...)`` -> h, h_x, h_y
* ``curvature(x, y, ...)`` -> h, h_x, h_y, h_xx, h_xy, h_yy
* ``nearest(x, y, z, ...)`` -> X, Y of the globally nearest surface point

They are plain Python: the tests call them as they are, and the kernels are these same functions
compiled. A kind that calls ``sine`` and ``cosine`` of :mod:`asperity.textures.samplers.sine`, with
that module in its sampler, has them exchanged for polynomials in batches:
:mod:`asperity.kernels.batch_sine`. A map has others for batches altogether
(``Kernels(in_blocks=True)``). Functions never raise; positions are finite because the public edge
checked them.
"""
