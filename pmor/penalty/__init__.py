"""Penalty contact of two meshed flanks: the schemes, the search, the equilibrium. The baseline beside `pmor.line`.

Three named schemes, `[contact] scheme`, in the full and in the reduced model alike:

``direct``
    Hermite patches through the *deformed* nodes; their points are projected on the mate's patches.
``paper``
    The same with averaged edge normals, projected on facets through the mate's points (Cosco et al. 2016); the paper's
    own with `slave = "pinion"`.
``facet``
    Bilinear facets and points on facets: the conventional contact element.

By default the slave is the gear whose tip is nearer, so that a tip corner always meets the mate's smooth flank, on
either gear alike. Forces are transferred by the paper's bilinear shares. A coarse mesh leaves ripple on the curve: it
is discretisation, not gear whine; raise the LoDM, or use line contact, which has next to none. While a pair enters or
leaves mesh a tip corner works off the line of action, and the ratio of the two contact torques differs from z2/z1 by
the amount that the energy balance requires: the teeth store or return energy.

Equilibrium is found by semismooth Newton steps with a guard, in two forms: the full model solves in the contact forces
(`equilibrium`: stable for stiff penalties), the reduced one in the amplitudes of its shapes (`kernels.newton`).
"""
