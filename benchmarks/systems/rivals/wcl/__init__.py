"""Wavelet representation of complex luminaires (Atanasov & Koylazov 2025), re-implemented."""
