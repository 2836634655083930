"""Random test campaigns: time-limited series of tests on random robots, files and poses.

The command ``make campaign SECONDS=300 SEED=7 ONLY=losses,general`` runs the campaigns ``losses``
and ``general`` for 300 s. Each module of ``tests.campaigns`` that defines ``CAMPAIGN`` is one
random test campaign. The test suite runs only small fixed samples of the random trials.
"""
