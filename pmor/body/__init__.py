"""An elastic gear: displacements of its flanks and stresses in its fillets under forces on the flanks.

The compliance between flank nodes i and k of the teeth of a gear has two parts,

    C_ik = C_local(i - k) + R_i S R_k^T.                                                                 (A)

`elastic_gear` makes the first, cyclic one from one condensed sector, held at an interface: today the bore. Contact
keeps `flank_compliance` of it, line contact `section_compliance` between its sections. The second has the rank of the
interface (`support`): it is the compliance of the blanks. Solid gears have none. `fillet_stress` and `root_stress`
are the stress at the roots under the same forces, `volume` the displacement and stress of whole sectors.
"""
