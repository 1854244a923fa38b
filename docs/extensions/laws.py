"""The one-line equations of effects and sensors as typeset on the site, by their text in the code.

Formulas that are wider than a phone are blocks, which scroll; those in a line do not break.
Where the text changes this has to follow: what is not here is shown as plain text, and a test says
so.
"""

LAWS = {
    "s_i+1 - s_i >= D along the race, D from a_i + a_i+1; after an impact the balls part "
    "with restitution times the speed of approach": (
        r"$s_{i+1} - s_i \ge D$ along the race, $D$ from $a_i + a_{i+1}$; after an impact the balls"
        " part with restitution times the speed of approach"
    ),
    "energy I (w - s'/a)^2 / 2, I = 2/5 m a^2: inertia m + I/a^2 along the race, and the "
    "spindle's acceleration spins the ball up": (
        r"Energy $\frac{1}{2} I \left(\omega - \dot{s}/a\right)^2$, $I = \frac{2}{5} m a^2$:"
        r" inertia $m + I/a^2$ along the race, and the spindle's acceleration spins the ball up"
    ),
    "g (sin(tilt) cos(direction), sin(tilt) sin(direction), -cos(tilt)) on moving parts": (
        "```math\n"
        r"g \left(\sin(\mathrm{tilt})\, \cos(\mathrm{direction}),\; \sin(\mathrm{tilt})\, "
        r"\sin(\mathrm{direction}),\; -\cos(\mathrm{tilt})\right)"
        "\n```\n\non moving parts"
    ),
    "f = -k_3 |u|^2 u": r"$f = -k_3 \left|u\right|^2 u$",
    "T = clip(T_a, +-T_max) - b w, T_a = k_p (w_c - w) + k_i z, z' = w_c - w - (T_a - "
    "clip(T_a)) / k_p": (
        r"$T = \mathrm{clip}\left(T_a, \pm T_\mathrm{max}\right) - b \omega$, "
        r"$T_a = k_p (\omega_c - \omega) + k_i z$, "
        r"$\dot{z} = \omega_c - \omega - \left(T_a - \mathrm{clip}(T_a)\right) / k_p$"
    ),
    "|F_i| <= mu max(N_i, 0); F_i = -mu max(N_i, 0) sign(theta_i') while it slides": (
        r"$\left|F_i\right| \le \mu \max(N_i, 0)$; "
        r"$F_i = -\mu \max(N_i, 0)\, \mathrm{sign}(\dot{\theta}_i)$ while it slides"
    ),
    "X(theta) = d + h n + h' t with h = R + lobe cos 2 (theta - lobe_angle), n = (cos "
    "theta, sin theta)": (
        r"$X(\theta) = d + h\, n + h' t$ with "
        r"$h = R + \mathrm{lobe} \, \cos\left(2 (\theta - \mathrm{lobe\_angle})\right)$, "
        r"$n = (\cos\theta, \sin\theta)$"
    ),
    "|F_i| <= (beta_b/a) max(N_i, 0); F_i = -(beta_b/a) max(N_i, 0) sign(theta_i') while "
    "it rolls": (
        r"$\left|F_i\right| \le \frac{\beta_b}{a} \max(N_i, 0)$; "
        r"$F_i = -\frac{\beta_b}{a} \max(N_i, 0)\, \mathrm{sign}(\dot{\theta}_i)$ while it rolls"
    ),
    "M0 e psi'' across the unbalance; (m h - I/a) psi'' on each ball": (
        r"$M_0 e \ddot{\psi}$ across the unbalance; $(m h - I/a) \ddot{\psi}$ on each ball"
    ),
    "f = -c v - k u": r"$f = -c v - k u$",
    "f_j = -c_j v_j - k_j u_j along the principal axes j = 1, 2, fixed in space": (
        r"$f_j = -c_j v_j - k_j u_j$ along the principal axes $j = 1, 2$, fixed in space"
    ),
    "F_i = -c_b s_i', s_i' the ball's speed along the race: R theta_i' on a round one": (
        r"$F_i = -c_b \dot{s}_i$, $\dot{s}_i$ the ball's speed along the race: "
        r"$R \dot{\theta}_i$ on a round one"
    ),
    "s = q round(clip(B(A(phi) f + n), -s_max, s_max) / q) at t = k / F_s; "
    "|B(F)|^2 = 1 / (1 + (F / F_c)^4), S_n = N^2": (
        "```math\n"
        r"s = q\, \mathrm{round}\left(\mathrm{clip}\left(B(A(\varphi) f + n), "
        r"-s_\mathrm{max}, s_\mathrm{max}\right) / q\right)"
        "\n```\n\n"
        r"at $t = k / F_s$; $\left|B(F)\right|^2 = \frac{1}{1 + (F / F_c)^4}$, $S_n = N^2$"
    ),
    "s = q round(clip(B(A(phi) r + n), -s_max, s_max) / q) at t = k / F_s; "
    "|B(F)|^2 = 1 / (1 + (F / F_c)^4), S_n = N^2": (
        "```math\n"
        r"s = q\, \mathrm{round}\left(\mathrm{clip}\left(B(A(\varphi) r + n), "
        r"-s_\mathrm{max}, s_\mathrm{max}\right) / q\right)"
        "\n```\n\n"
        r"at $t = k / F_s$; $\left|B(F)\right|^2 = \frac{1}{1 + (F / F_c)^4}$, $S_n = N^2$"
    ),
}
