"""The rig diagnoses itself: the manoeuvre that tells most in a minute is proposed, carried out, and examined."""
