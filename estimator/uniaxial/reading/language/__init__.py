"""The words, titles and units of testing machines, in the languages that they speak."""
