"""The report's plots with Matplotlib. Each takes Results and optionally axes, and returns the axes."""
import numpy as np


def _axes(ax, **labels):
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.figure(figsize=(7, 4), constrained_layout=True).gca()
    ax.set(**labels)
    ax.grid(alpha=0.3)
    return ax


def _moving(results, most):
    """Names of the blocks that moved, the farthest first."""
    position = results.blocks.position
    if len(position) == 0:
        return []
    way = np.nanmax(np.linalg.norm(position - position[0], axis=2), axis=0)
    order = np.argsort(-np.nan_to_num(way, nan=-1.0), kind="stable")[:most]
    return [results.block_names[b] for b in order if way[b] > 1e-6]


def profile(results, ax=None, most=12):
    """Height of the centroids over the distance travelled in plan."""
    ax = _axes(ax, xlabel="distance travelled in plan [m]", ylabel="height of the centroid [m]")
    for name in _moving(results, most):
        p = results.blocks[name].position
        way = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(p[:, :2], axis=0).T))])
        ax.plot(way, p[:, 2], label=name)
    if ax.lines:
        ax.legend()
    return ax


def plan(results, ax=None, most=100):
    """Paths of the centroids in plan."""
    ax = _axes(ax, xlabel="x [m]", ylabel="y [m]", aspect="equal")
    for name in _moving(results, most):
        p = results.blocks[name].position
        ax.plot(p[:, 0], p[:, 1], lw=1)
        ax.plot(p[-1, 0], p[-1, 1], "k.", ms=3)
    return ax


def speed(results, ax=None, most=12):
    """Speed of the centroids over time."""
    ax = _axes(ax, xlabel="time [s]", ylabel="speed [m/s]")
    for name in _moving(results, most):
        ax.plot(results.time, results.blocks[name].speed, label=name)
    if ax.lines:
        ax.legend()
    return ax


def kinetic(results, ax=None, most=12):
    """Kinetic energy of the blocks over time."""
    ax = _axes(ax, xlabel="time [s]", ylabel="kinetic energy [kJ]")
    for name in _moving(results, most):
        ax.plot(results.time, results.blocks[name].kinetic / 1e3, label=name)
    if ax.lines:
        ax.legend()
    return ax


def energy(results, ax=None):
    """The ledger: where the energy is and where it went. Numerical dissipation without what follows the step
    (step_dependence)."""
    ax = _axes(ax, xlabel="time [s]", ylabel="energy [kJ]")
    names = ("kinetic", "strain", "contact", "friction_work", "damping_work", "damage_work")
    entries = {name: results.ledger[name] for name in names}
    entries["potential, less the start's"] = results.ledger.potential - results.ledger.potential[0]
    entries["numerical"] = results.ledger.algorithmic - results.ledger.step_dependence
    entries["residual"] = results.ledger.residual
    for name, values in entries.items():
        if np.any(values != 0):
            ax.plot(results.time, values / 1e3, label=name.replace("_", " "))
    if ax.lines:
        ax.legend()
    return ax


def contact_force(results, structure=None, ax=None, window=1.5e-3):
    """Size of the contact force on a structure (all by default): means of the coupled steps, and over
    `window` [s] as in the report; None: not."""
    ax = _axes(ax, xlabel="time [s]", ylabel="contact force [kN]")
    t, force = results.contact_force(structure)
    ax.plot(t, np.linalg.norm(force, axis=1) / 1e3, lw=0.6, alpha=0.5, label="mean over a step")
    if window and len(t):
        ft, mean = mean_force(results, structure, window)
        ax.plot(ft, mean / 1e3, label=f"mean over {1e3 * window:g} ms")
        ax.legend()
    return ax


def mean_force(results, structure=None, window=1.5e-3, spacing=1e-4):
    """Size of the contact force, mean over a window about each instant: [n] s, [n] N.

    The impulses of the rows, spread over (time - dt, time], are taken between instants `spacing` seconds
    apart; 1.5 ms is the window of the report.
    """
    c = results.contacts
    keep = results.contacts_of(structure)
    if not keep.any():
        return np.zeros(0), np.zeros(0)
    end, dt, force = c.time[keep], c.dt[keep], c.force[keep]
    bins = max(1, round(window / spacing))
    first = int(np.floor((end - dt).min() / spacing)) - bins
    edges = spacing * np.arange(first, int(np.ceil(end.max() / spacing)) + bins + 1)
    # Impulse up to each edge of the bins, exactly: the sum of ramps that begin and end with the rows.
    at = np.concatenate([end - dt, end])
    order = np.argsort(at, kind="stable")
    slope = np.cumsum(np.concatenate([force, -force])[order], axis=0)
    at = at[order]
    impulse = np.concatenate([np.zeros((1, 3)), np.cumsum(slope[:-1] * np.diff(at)[:, None], axis=0)])
    at_edges = np.stack([np.interp(edges, at, impulse[:, k]) for k in range(3)], -1)
    size = np.linalg.norm(at_edges[bins:] - at_edges[:-bins], axis=1) / (bins * spacing)
    return 0.5 * (edges[:-bins] + edges[bins:]), size


def base_force(results, structure, ax=None):
    """Reactions beyond those at the start."""
    ax = _axes(ax, xlabel="time [s]", ylabel="base force less that at the start [kN]")
    force = results.structures[structure].base_force
    for k, name in enumerate("xyz"):
        ax.plot(results.time, (force[:, k] - force[0, k]) / 1e3, label=name)
    ax.legend()
    return ax


def displacement(results, structure, ax=None):
    """Size of the displacement of the probes."""
    ax = _axes(ax, xlabel="time [s]", ylabel="displacement [mm]")
    s = results.structures[structure]
    if "probe_displacement" in s:
        for p, name in enumerate(s.probe_name):
            ax.plot(results.time, 1e3 * np.linalg.norm(s.probe_displacement[:, p], axis=1), label=name)
        if ax.lines:
            ax.legend()
    return ax


def member_shear(results, structure, ax=None):
    """Largest shear over time along each member, with V_Rd by mean strengths (the smaller of both axes) where
    it is known."""
    ax = _axes(ax, xlabel="largest shear [kN]", ylabel="distance from the base [m]")
    m = results.structures[structure].members
    largest = np.nanmax(np.linalg.norm(m.shear, axis=3), axis=0)
    for i, name in enumerate(m["name"]):
        line, = ax.plot(largest[i] / 1e3, m.station[i], label=name)
        known = "shear_resistance" in m and np.isfinite(m.shear_resistance[i, 1]).any()
        resistance = np.nanmin(m.shear_resistance[i, 1]) if known else None
        if resistance is not None:
            ax.axvline(resistance / 1e3, color=line.get_color(), ls="--", lw=1)
    ax.legend()
    return ax


def report(results, structure=None):
    """All of them on one page; returns the figure."""
    import matplotlib.pyplot as plt

    names = list(results.structures)
    structure = structure or (names[0] if names else None)
    rows = 4 if structure else 2
    figure, axes = plt.subplots(rows, 2, figsize=(12, 4 * rows), constrained_layout=True)
    flat = axes.ravel()
    profile(results, flat[0])
    speed(results, flat[1])
    energy(results, flat[2])
    plan(results, flat[3])
    if structure:
        contact_force(results, structure, flat[4])
        base_force(results, structure, flat[5])
        displacement(results, structure, flat[6])
        if "members" in results.structures[structure]:
            member_shear(results, structure, flat[7])
        else:
            flat[7].axis("off")
    figure.suptitle(results.summary["title"])
    return figure
