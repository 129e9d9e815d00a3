"""What went wrong with an answer. `diagnose` says the first that fits of a registered mistake (`recognition`), the form
in words (`forms`), a slip that a program can make by itself (`slips`) and the anatomy of the error (`anatomy`). What
wrong answers give on the public cases of a lab is kept beside its tasks (`public_answers`).
"""
