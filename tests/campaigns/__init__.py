"""Random campaigns: trials on robots, files and poses that nobody chose, for a given time.

``make campaign SECONDS=300 SEED=7 ONLY=losses,general`` runs them. Each campaign is a file of this
package that ends in ``CAMPAIGN``; tests run small fixed samples of the same trials.
"""
