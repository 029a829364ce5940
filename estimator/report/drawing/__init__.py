"""What pictures of a phantom share: scene, view, painter, marks, scales."""
