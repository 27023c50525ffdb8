# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Body, Effect, Parameter, Values


class LinkInertia(Effect):
    """Inertia I added about the link's centre of mass, mass kept."""

    name = 'link_inertia'
    family = 'inertia'
    hook = 'body'
    parameters = (Parameter('I', 'kg m2', role='amplitude', linear=False),)
    equation = 'inertia about the centre of mass + I'
    looks_like = 'A link turns more slowly or faster, its weight is right.'
    confused_with = 'armature on a single hinge: the same.'
    reveal = 'Fast motion with known torques, and free swings.'

    def body(self, p: Values, link: Body) -> Body:
        xx, yy, zz, *products = link.inertia
        turned = (xx + p['I'], yy + p['I'], zz + p['I'], *products)
        return link._replace(inertia=turned)
