"""How near a trained lamp of the zoo is to the real one, stage by stage."""
