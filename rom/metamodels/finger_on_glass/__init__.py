"""Metamodels of the finger on glass: they answer whole load paths, displacement field and contact alike."""
