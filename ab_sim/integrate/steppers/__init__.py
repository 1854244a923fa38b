"""The steppers, one file each; ``registry`` finds them here."""
