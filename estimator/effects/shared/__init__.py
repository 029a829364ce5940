"""What several effects share: axes, places, instants, histories, zeros."""
