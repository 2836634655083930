"""Five or six joints of any geometry, and more of which six are left."""
