"""A download becomes submissions: archives, the roster, untrusted notebooks; nothing is executed here."""
