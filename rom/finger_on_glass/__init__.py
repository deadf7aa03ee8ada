"""A finger on glass: a nonlinear section with collagen fibres, pressed on a rigid plate and slid along it.

The model is that of "Collagen Induces Anisotropy in Fingertip Subcutaneous Tissues During Contact": a transverse
section in generalized plane strain, HGO tissue, a rigid flat plate, Coulomb friction. Lengths in mm, forces in N for
each mm of the finger's effective length, stresses in MPa. What the publication leaves open is an explicit, declared
input.
"""
