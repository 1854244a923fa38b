"""What carries the balls: deck, rotor and unbalance, as they move on their suspension.

A carrier is a NamedTuple of constants, one file each. It turns forces at points into its own
generalised forces, and supplies its block of the arrowhead; balls, friction and impacts know
nothing of it. It has

    STATES, UNKNOWNS
        how many states of its own it has, and accelerations that are solved for
    STATE_NAMES
        of its states, for messages
    NEEDS_ANGLE
        whether its equations contain the spindle's angle whatever the effects are
    WAYS
        along how many axes it moves
    COORDINATES
        see below; 0 if it says nothing of that
    CHANNELS
        names of what a trajectory shows of it: displacement, velocity and acceleration along these
        axes come first

in Python the methods

    place(self, states, psi)
        where the deck is along these axes, from its own states, one line for each
    felt(self, system, shown, point)
        specific force at a point of the deck on its axes, from its channels, one line for each
        sample
    at_rest(self, states)
        its channels if it stood still in such states, one line
    scale(self, length, speed)
        magnitudes of its states, for errors to be measured by, from a length and a spindle speed
    tangent(self, states)
        the directions in which its own states can move without leaving what they mean: orthonormal
        columns, two for each of its unknowns
    energy(self, system, state, psi, speed) -> J
        kinetic and stored

and the methods, compiled into kernels, of a Plant, the Spindle's motion and the state:

    begin(self, plant, spindle, state) -> frame
        its own equations into ``room.block``, with the balls' masses where they move with it:
        the symmetric matrix' upper triangle, the spindle's row and column last, and the forces;
        ``frame`` is whatever the other methods need once more
    bear(self, plant, spindle, frame, c, s, i, state) -> N
        a ball at outward normal (c, s) on the rotor's axes: COS, SIN, LOAD, REACH and PRESS in the
        table, its mass and forces into the block; returns the force along the race [N]
    move(self, plant, spindle, frame, state, slope)
        the rates of change of its states, once the accelerations are known
    show(self, plant, spindle, c, s, state, acceleration, shown)
        its channels; (c, s) is cosine and sine of the spindle's angle
    dissipate(self, plant, spindle, state) -> W
        what its suspension dissipates
    kick(self, state, jumps, velocities)
        add jumps of velocity, in the order of the accelerations, to what has the velocities where
        the state has them
    straighten(self, state) -> bool
        take out what has drifted and means nothing; whether there was anything

and, if COORDINATES is not 0, for those who solve exactly what of its motion is x'' + c x' + k x = 0
in each of so many coordinates x (``own_motion``): ``own`` is what its scene module's ``own_motion``
says of them, v are their rates, both on axes that stand still for a while; ``axes`` are cosine and
sine of the angle that the rotor's have turned in that time,

    to_coordinates(self, own, state, x, v)
        x and v of a state, at its beginning
    from_coordinates(self, own, axes, x, v, state)
        the reverse, then
    give_way(self, plant)
        the accelerations that are solved for, under the forces in the room and the balls' path
        accelerations there
    coordinate_accelerations(self, plant, spindle, own, axes, state, out)
        x'' into ``out``, of those in the room
    accelerate(self, plant, own, axes, state, change)
        add to those in the room a change of x''
    on_next_axes(self, c, s, force)
        forces on the right of these equations, on axes that have turned by an angle
"""
