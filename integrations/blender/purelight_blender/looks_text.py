"""What the user is told where no OSL runs."""

NOTE = "shown by an IES light and a baked look: alike from all sides, right from afar only"
