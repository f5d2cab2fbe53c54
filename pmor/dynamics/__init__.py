"""The pair in motion: how gears vibrate on a mesh whose stiffness varies, and which may part and meet again.

The gears are rigid bodies on shafts and bearings, q their displacements about the uniform rotation; all that the mesh
knows of them is how far the pinion's flanks run ahead along the line of action, x = l . q, and where in the mesh cycle
the pair is, its phase psi (2 pi per pitch):

    M q'' + C q' + K q + l F(psi, x) = f.                                                                        (1)

F is the force law by displacement: `kernels.laws`, tabulated by `force_table`. One way to a periodic answer is harmonic
balance (`harmonic_balance`, `continuation`, `stability`, `period_doubling`; all together `response`), the other to
integrate over time (`integration`); they share nothing but (1) and the law.

Units are those of the system that is given; for gears mm, N, s and t (1 t mm/s2 = 1 N).
"""
