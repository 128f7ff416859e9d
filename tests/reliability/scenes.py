"""Parts of scenes that several programs of this folder use."""

MATERIALS = """[[material]]
name = "rock"
density = 2600
[[material]]
name = "ground"
"""


def rigid_contact(first, second, friction, more=""):
    return f'[[interface]]\nbetween = ["{first}", "{second}"]\nfriction = {friction}\nnormal_stiffness = "hard"\n{more}'
