def plane_axes(chart):
    from gms_fsm.language import names_in

    v = chart.velocities[0]
    if chart.variables:
        return (v, chart.variables[0])
    read = [
        n
        for g in chart.guards.values()
        for n in sorted(names_in(g))
        if n not in chart.parameter_names and n not in (v, "t")
    ]
    return (v, read[0]) if read else None


def plane_threshold(trace):
    return 1e-6
