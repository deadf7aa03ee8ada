"""The toolkit's own errors: each carries one sentence with the value, the rule and the remedy."""


class RomError(Exception):
    """Base of every error that the toolkit raises on purpose."""


class AnatomyError(RomError, ValueError):
    """An anatomy, a tissue or a mesh density that cannot exist."""


class SchemaError(RomError, ValueError):
    """A file or dataset that is truncated, foreign, of another schema version or of another mesh."""


class NotFittedError(RomError, RuntimeError):
    """A metamodel was asked before it was fitted."""


class SolverError(RomError, RuntimeError):
    """A factorization, an eigensolve or a refinement that did not deliver."""


class NoWeightsError(RomError, ValueError):
    """Trained weights that do not come with the toolkit, or not for this mesh or these held-out cases."""
