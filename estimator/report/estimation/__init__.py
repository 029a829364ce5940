"""The report of an estimation: one page, from the sentence that answers to the numbers behind it."""
