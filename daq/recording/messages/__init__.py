"""The messages of a recording: samples as rows of records, images without loss."""
