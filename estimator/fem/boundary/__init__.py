"""The boundary value problem: how the tissue is anchored and gripped, and how either yields."""
