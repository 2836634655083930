"""Random test campaigns: time-limited trials on random robots, files and poses.

``make campaign SECONDS=300 SEED=7 ONLY=losses,general`` runs campaigns. Each campaign is a module
of this package that defines ``CAMPAIGN``. Tests run small fixed samples of the trials.
"""
