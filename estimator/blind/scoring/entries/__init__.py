"""Anyone's answers to a sealed set: ``retraction-answers/1``, its JSON Schema, and what is wrong with such a file."""
