"""From the streams of a recording to rows that belong together in time, in the tissue frame."""
