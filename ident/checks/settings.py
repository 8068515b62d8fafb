"""Every number that decides about a remark, with its unit, meaning, and reason."""

from ident.model.setting_fields import Section, count, positive, share


class CheckSettings(Section):
    """Bounds of the checks; all were set between right recordings and the faults looked for."""

    # motion
    beyond_limits_rad: float = positive(
        0.1,
        "[rad or m] positions beyond the URDF's limits by this are remarked on: URDFs round their"
        " limits, and stops give way",
    )
    jump_speeds: float = positive(
        5.0,
        "times the URDF's velocity limit: a faster step from sample to sample is no motion;"
        " drives stop at the limit itself",
    )
    jump_share: float = share(
        2e-4,
        "of the samples that may jump before it is remarked on: single glitches weigh little in"
        " least squares",
    )
    jump_share_refused: float = positive(
        0.05, "the same, where it is no recording of one arm: one sample in twenty"
    )
    jump_share_always: float = positive(
        0.5, "the same, from which no accident is the reason, but a unit or the order"
    )
    interpolation_doubtful: float = positive(
        0.02,
        "error of every other sample, predicted from its neighbours, beside the joint's own"
        " range: about 12 samples for each period of the fastest part of the motion",
    )
    interpolation_refused: float = positive(
        0.2, "the same, where velocities are lost: 5 samples for each period"
    )
    alternating_samples: int = count(
        64, "of a stretch that can show two motions in turn: 32 of each"
    )
    alternating_ratio: float = positive(
        4.0,
        "error of that prediction beside the one from every other sample alone: one motion is"
        " smoother at the closer spacing, two in turn are not",
    )
    hardly_moves_rad: float = positive(
        0.12, "[rad or m] a joint that spans less shows friction's break-away and little else"
    )
    hardly_moves_rad_s: float = positive(
        0.03,
        "[rad/s or m/s] a joint that never goes faster stays in the range of static friction,"
        " which the model lacks",
    )
    short_s: float = positive(5.0, "[s] of motion; below this a poor condition is called too short")
    condition_doubtful: float = positive(
        500.0,
        "ratio of the largest and the smallest singular value of the base parameters' columns at"
        " length one: good excitations have 5 to 30, the poorest real recordings that still"
        " predict other motion 300",
    )
    condition_refused: float = positive(2e4, "the same, where combinations of parameters are noise")
    aside_of_line: float = share(
        0.02,
        "of the variance of the joints' positions, each scaled to one, that does not lie on one"
        " line: a leg and an arm whose joints move as one had 0.001 and 0.003, excitations have 0.3"
        " to 0.8",
    )

    # samples
    lost_share: float = share(
        5e-3,
        "of the samples that may be missing or repeated before the result is doubtful: holes are"
        " cut out, so that a few of them cost little",
    )
    lost_refused: float = positive(
        0.5, "of the samples missing or repeated: what is left is not the recording"
    )
    fast_steps: float = positive(
        12.0, "a move of so many smallest ones, or usual errors, shows a lost sample"
    )
    held_move: float = positive(0.05, "of the expected move: less is a repeated sample")
    jumped_move: float = positive(1.75, "of the expected move: more is a lost sample")
    jitter_steps: int = count(
        10, "on both sides of such a move, in which a clock that jitters makes up for it"
    )
    way_gained: float = positive(
        0.5,
        "steps that these moves must add to the way around them: 1 where a sample is lost, 0 where"
        " the clock only jitters",
    )

    glitch_noise: float = positive(
        5.0,
        "times the 0.99 quantile of the distances by which positions lie beyond both neighbours,"
        " which is noise: farther out is none",
    )
    glitch_ranges: float = positive(
        4.0,
        "times the range of 96 % of a joint's torque by which a single sample lies beyond both"
        " neighbours: real recordings reach 3.1",
    )
    glitch_torque_noise: float = positive(
        10.0,
        "times the 0.99 quantile of such distances of a torque, where it is also more than the"
        " range of 96 % of that torque: real recordings reach 6, spikes of 5 deviations 20",
    )
    glitch_share: float = share(
        0.01, "of a joint's samples that are replaced at most: more are no accidents, but jumps"
    )

    # torque
    constant_share: float = share(
        1e-3,
        "rms of the torque about its mean, beside the largest torque of the joint or 1e-6: less"
        " is a constant",
    )
    clipped_share: float = share(
        2e-3, "of the samples at which a torque stays at its largest value before it may be clipped"
    )
    clipped_beyond: float = positive(
        1.5,
        "usual errors by which the arm needs more than that, in the mean: a motor that gives no"
        " more is recorded rightly, and comes to 0.3",
    )
    offset_share: float = share(
        1.0, "a constant torque beside the largest of all the rest: real joints reach 0.16"
    )
    offset_needed: float = positive(
        2.0, "times the joint's error without it: less, and its weight stands in for it"
    )
    frozen_rad: float = positive(
        0.2,
        "[rad or m] that a joint moves in both directions on one and the same torque before that"
        " is called none: friction alone changes its sign there",
    )
    unexplained_joint: float = positive(
        0.95,
        "relative error of one joint on data that were not fitted: from here on its torque looks"
        " like noise",
    )
    poorly_predicted: float = positive(
        0.7,
        "relative error of one joint on data that were not fitted, under the model that is"
        " written: from here on it explains less than half of the torque's mean square; real arms"
        " reach 0.52",
    )
    error_doubtful: float = positive(
        0.25,
        "relative error over all joints on data that were not fitted, with friction and offset:"
        " real arms without their couplings reach 0.17",
    )
    unseen_ratio: float = positive(
        2.5,
        "error on data that were not fitted over that on data that were, beyond which the motion"
        " tells the parameters too little: 2.3 at most for motions of this project's tables that"
        " are long enough, 1.0 to 1.7 for real excitations, 2.8 to 3.6 for single periods whose"
        " models fail on the next, 4.6 and more for motions of one way",
    )
    error_refused: float = positive(
        0.75, "the same, where the model says hardly more than a constant"
    )

    # hypotheses
    scan_from: float = positive(
        0.06,
        "relative error over all joints from which swapped columns, zero poses, and gravity are"
        " tried: below, no such fault is there",
    )
    scan_joint: float = positive(0.6, "relative error of one joint from which the same is tried")
    believed_ratio: float = positive(
        0.65,
        "a hypothesis must lower the held-out error to this part; on 11 real recordings no wrong"
        " one came below 0.81",
    )
    scale_ratio: float = positive(
        0.8,
        "the same of one joint's torque that is half as large again or more: of 46 right recordings"
        " none came below 0.86, and none of them that tells its parameters below 0.9",
    )
    late_s: float = positive(
        0.03,
        "[s] between torque and motion: filters and current loops of drives take up to 0.02, and"
        " what a model lacks looked like up to 0.05 on one real arm",
    )
    late_by_fit_s: float = positive(
        0.06, "[s] of a delay that a fit's leftover shows; on ten real recordings 0.009 at most"
    )
    late_by_fit_share: float = share(
        0.25, "of that leftover, by which a shorter one is told; on 35 right recordings 0.06"
    )
    late_deviations: float = positive(5.0, "standard errors by which torque must be late or early")
    late_ratio: float = positive(
        0.8,
        "a delay must lower the joints' mean error to this part; on 13 real recordings none came"
        " below 0.90",
    )
    late_alone: float = positive(
        0.5,
        "the same of one joint whose torque alone is late: friction that remembers looks late as"
        " well, down to 0.64 at one of 88 joints of real recordings",
    )
    slides_speed: float = positive(
        0.3,
        "part of a joint's rms speed from which it slides for certain: about turning round it may"
        " stick, and its torque is no function of the motion",
    )
    friction_power: float = positive(
        0.02, "power taken out of friction, beside rms torque times rms speed: less may be rounding"
    )
    friction_deviations: float = positive(
        4.0, "standard errors by which friction's power must be negative"
    )
    sign_cost: float = positive(
        1.15,
        "the error may rise by this factor where something else tells: an arm's other recordings"
        " its signs, or its weight a zero pose and how it is mounted",
    )
    impossible_ratio: float = positive(
        1.3,
        "times the held-out error of ordinary least squares that a possible arm leaves: from here"
        " on the data ask for what no arm is; 1.1 at most on nine real arms, 1.4 to 1.6 on a tenth",
    )
    impossible_error: float = positive(
        0.05, "of the torque that a possible arm leaves held-out: a smaller error does no harm"
    )
    driving_friction: float = positive(
        0.2,
        "torque by which a joint's line of friction over speed drives the motion somewhere in its"
        " range, beside its rms torque; real arms: 0.01 at most where friction is determined",
    )
    driving_ratio: float = positive(
        2.0,
        "times the joint's error with friction that always brakes: from here on that drive is no"
        " matter of chance; 1.0 on thirteen real arms, 3 to 8 on the one that has it",
    )
    driving_error: float = positive(
        0.1,
        "relative error of the joint with friction that always brakes: less is fitted well enough",
    )
    turned_ratio: float = positive(
        0.3,
        "what the URDF's links leave of one joint's torque must fall to this part if position and"
        " torque of a joint are both turned round; on 8 real recordings it came to 0.69, on"
        " simulated arms with such a joint below 0.11",
    )
    scale_off: float = positive(
        0.05,
        "part by which positions must be too large or small: less may be what the model lacks,"
        " such as an elastic transmission",
    )
    angle_off_rad: float = positive(
        0.1, "[rad] of a wrong zero, or of an encoder's drift over a recording; as above"
    )
    positions_ratio: float = positive(
        0.5,
        "product over the joints of what is left of their errors with the positions mended: on 16"
        " real recordings it came to 0.62, with a fault that shows to 0.43 and less",
    )
    gain_bounds: float = positive(
        4.0,
        "torque may differ from the URDF's by this factor: real masses differ from URDFs by less,"
        " gears and units by more",
    )
    gain_explained: float = positive(
        0.8,
        "part of the torque beside friction that the URDF's own weight must explain before its"
        " size is believed: placeholders explain less",
    )
    size_apart: float = positive(
        6.0,
        "torque and the URDF's differ by less, even where the URDF does not fit: by 0.6 to 2.3 on"
        " 15 real recordings, 0.08 for currents",
    )
    cad_doubtful: float = positive(
        0.4,
        "part of the torque beside friction that the URDF's links explain with one factor, below"
        " which they are not this arm's: real arms with a spring at a joint, which URDFs lack,"
        " reach 0.55",
    )
    cad_looks: float = positive(0.85, "the same, below which zero poses and gravity are tried")
    cad_fits: float = positive(0.95, "the same, which a right zero pose or gravity must reach")
    gain_known: float = positive(
        0.3,
        "relative standard error of a drive's gain above which it is not known: its torque is"
        " then a guess",
    )
    gain_sure: float = positive(
        0.1,
        "relative standard error of the gains' common factor above which results in N m are"
        " doubtful",
    )
    unit_tolerance: float = positive(
        1.7, "factor about a known unit within which the unit is believed"
    )
    load_ratio: float = positive(
        0.5,
        "a load that the URDF lacks must leave this part of what a factor at each joint leaves"
        " before it is the reason for torque far too large: at a lone joint they are one",
    )
    load_left: float = positive(
        0.01,
        "part of the torque beside friction that the URDF may leave with that load: with masses"
        " that are 15 % off a true one leaves 0.002, positions in turns 0.02",
    )
    load_masses: float = positive(
        10.0, "mass of that load, in masses of the arm, from which another unit is likelier"
    )
    one_factor: float = positive(
        1.5,
        "torque of all joints may differ from the URDF's by this one factor: of ten recordings"
        " none whose links explain the torque so well differs by more but for a load",
    )
    one_factor_left: float = positive(
        0.02, "part of the torque beside friction that the URDF may leave with that factor"
    )
    gain_apart: float = positive(
        3.0, "ratio of two joints' factors from which they are no common one"
    )
    sway_share: float = share(
        0.3, "of the unexplained torque that one oscillation of the base must explain"
    )
    sway_peak: float = positive(
        3.0,
        "share that the frequency of the base explains, beside the median of all frequencies: a"
        " sway has one",
    )
    sway_error: float = positive(0.05, "relative error below which no sway is looked for")
    load_share: float = share(
        0.3,
        "of the squared unexplained torque that a load must explain which comes or goes: of 35"
        " right recordings 0.29, but where friction explains more or its centre is metres away",
    )
    load_halves: float = positive(
        1.09, "times that, which loads of its halves may explain: of most true ones 1.05, else 1.12"
    )
    load_over_friction: float = positive(1.3, "times what friction of that time explains")
    load_error: float = positive(0.01, "relative error below which no such load is told")
    disagree_deviations: float = positive(
        5.0, "standard errors between recordings from which a parameter contradicts"
    )
    disagree_ratio: float = positive(
        2.0,
        "a recording's error under the others' parameters, beside its own and the others': less is"
        " of no consequence",
    )


DEFAULT = CheckSettings()
"""As shipped."""
