"""Shapes in which contact deforms the teeth, and their errors.

`[reduction] shapes`, of penalty contact; line contact is solved for its line loads and has none. In parentheses:
unknowns, and the largest error of the STE against full FE at 144 unseen positions of the paper's pair (16 x 8 elements,
Hermite patches, 40 angles x 3 torques trained).

``flank_lines`` (default; 13; 0.0067 %)
    The load distribution over the width of each flank line. For all common work, any scheme, little training.
``positions`` (7; 0.12 %)
    Raw snapshots at each trained roll position, interpolated: the paper's way.
``pod`` (7; 0.31 %)
    POD of the snapshots at each position, in the energy inner product, aligned (Procrustes), interpolated. The same,
    trained over many torques: `pod_tolerance` sets the size.
``global_pod`` (87; 0.0012 %)
    One POD basis for all positions. For seeing why not: contact that moves is *linearly inseparable*, so that it takes
    ten times the shapes of `pod`.
``static_modes`` (121; exact)
    Unit forces on all active flank nodes. No training; for the exact answer, or a handful of positions.

The training gives each *flank line* (a row of flank nodes of equal roll angle) the distribution of its load over the
width; online, each active line of the contact has an amplitude of its own, on pinion and wheel, and the load sharing
comes out of the solution. Nothing is interpolated over the angle, so that the dent moves with the contact. It is the
one that is good with any scheme, mesh and training, and the only one that may be trained greedily and still be small.
`interpolation` of `positions` and `pod` over the roll position: `linear`, or `cubic` for dense training where all is
smooth. Geodesics between the subspaces (Grassmann; Amsallem & Farhat, AIAA J. 46 (2008) 1803) were no better than
linear with aligned modes: 0.37 % against 0.31 %. Both move in the same planes.
The error bar on every result, and where it is no bound: `pmor.penalty.kernels.estimate`.
"""
