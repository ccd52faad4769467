"""What can be computed: a folder for each analysis; ``rig`` is shared by those that vibrate."""
