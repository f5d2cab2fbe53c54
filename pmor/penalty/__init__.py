"""Contact of two meshed flanks: the schemes, the search, the equilibrium.

Five named schemes, `[contact] scheme`, in the full and in the reduced model alike:

``line`` (default)
    Exact involutes, displaced by a C1 cubic of the nodal displacements; one line load per section and tooth pair; the
    dent, which no mesh of a gear resolves, in closed form (`line_contact`). No penalty. For transmission error, load
    sharing and Hertz pressure on any mesh, 8 elements included.
``strip``
    The same flanks; penalty pressure at Gauss points between the ends of the strip of contact. For the pressure itself,
    with ten elements in the contact.
``direct``
    Hermite patches through the *deformed* nodes; their points are projected on the mate's patches, penalty. For
    surfaces that are no involutes, and for comparison.
``paper``
    The same with averaged edge normals, projected on facets through the mate's points (Cosco et al. 2016); the paper's
    own with `slave = "pinion"`.
``facet``
    Bilinear facets and points on facets: what other programs do.

In `line` and `strip` forces act on the very displacements that the gap uses; the other schemes use the paper's bilinear
transfer. No gear is the slave in `line`; elsewhere it is, by default, the gear whose tip is nearer, so that a tip
corner always meets the mate's smooth flank, on either gear alike. With a penalty, a coarse mesh leaves ripple on the
curve: it is discretisation, not gear whine; raise the LoDM, or use line contact, which has next to none. While a pair
enters or leaves mesh a tip corner works off the line of action, and the ratio of the two contact torques differs from
z2/z1 by what the energy balance asks for: the teeth store or give back energy.

Equilibrium is found by semismooth Newton steps with a guard, in two forms: the full model solves in the contact forces
(`equilibrium`: stable for stiff penalties), the reduced one in the amplitudes of its shapes (`kernels.newton`).
"""
