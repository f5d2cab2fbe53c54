"""An elastic gear: displacements of its flanks and stresses in its fillets under forces on the flanks.

The compliance between flank nodes i and k of the teeth of a gear has two parts,

    C_ik = C_cyclic(i - k) + B S_ik B^T.                                                                 (A)

`elastic_gear` makes the first, cyclic one from one condensed sector, held at its bore, or standing within the rim on a
`blank` of revolution. Contact keeps `flank_compliance` of it, line contact `section_compliance` between its sections.
The second, of low rank, is that of holes, which make teeth differ (`support`). `fillet_stress` and `root_stress`
are the stress at the roots under the same forces, `volume` the displacement and stress of whole sectors.
"""
