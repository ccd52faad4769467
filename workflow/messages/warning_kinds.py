"""Kinds of warnings.

W0xx are about the input, W1xx about contacts, W2xx about structures, W3xx about wear, W4xx about
vibration and time, W5xx about fits and measurements, W9xx about files and processes. New kinds get
new numbers, and a number is never used again.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import unique
from typing import NamedTuple

from workflow.messages.kinds import PATTERN, MessageKind


@unique
class WarningKind(MessageKind):
    """Kind of warning. The results are computed, but some may be wrong or missing."""

    @property
    def is_on_results(self) -> bool:
        """True unless the warning is about files and processes only."""
        return not self.code.startswith("FS-W9")

    # --- input ----------------------------------------------------------------------------------
    UNUSUAL_VALUE = (
        "FS-W001",
        "A value is outside its usual range",
        "The value is far from those of machines, test rigs and laboratories. Most often its unit "
        "is not the one that was meant. The run uses the value as given.",
        "Compare value and unit with your data. If they are right, ignore the warning.",
    )
    UNUSUAL_LENGTH = (
        "FS-W002",
        "A length suggests another unit",
        "A body, a rounding, measured heights or the distance of measured points is much larger or "
        "smaller than usual for such a part. Files often have no unit, or not the one assumed.",
        "Give the unit of the file, or correct the entry. If the length is right, ignore the "
        "warning.",
    )
    UNUSUAL_LOAD = (
        "FS-W003",
        "A load suggests another unit",
        "The load gives a pressure, a shear or a displacement that is far too small or too large "
        "for these bodies.",
        "Check the unit of the load, and of lengths and Young's modulus.",
    )
    FRICTION_EXCEEDED = (
        "FS-W004",
        "A tangential force exceeds friction",
        "The contact cannot carry a tangential force above the coefficient of friction times the "
        "normal force. The bodies slide apart, and the run ends there with an error.",
        "Lower the tangential force, raise the normal force, or impose a displacement instead.",
    )
    LONG_STROKE = (
        "FS-W005",
        "The stroke is long compared with the contact",
        "The bodies move by many times the width of the contact, which is not fretting. Most often "
        "the unit of the stroke is wrong.",
        "Check the unit of the stroke.",
    )
    STEP_LONGER_THAN_RUN = (
        "FS-W006",
        "A wear step is longer than the run",
        "The run makes a single jump, on the pressures of the unworn contact. The worn shape and "
        "the errors of the steps are then hardly known.",
        "Take a shorter step, so that the run makes ten jumps or more.",
    )
    LONG_CELLS = (
        "FS-W007",
        "The cells of the grid are far from square",
        "One direction is resolved much better than the other, which costs time without a gain in "
        "accuracy.",
        "Choose the numbers of cells in proportion to the sides of the grid.",
    )
    UNSUITABLE_GRID = (
        "FS-W008",
        "The grid does not suit the contact",
        "By Hertz's formulas the unworn contact is larger than the grid, or covers hardly any of "
        "its cells: pressures would be cut off or meaningless. Or a grid that repeats itself has a "
        "step between opposite borders, on which the contact presses.",
        "Change the size of the grid or its number of cells; give heights whose borders fade into "
        "each other.",
    )
    LOST_ROUGHNESS = (
        "FS-W009",
        "The grid is too coarse for a measured surface",
        "A large part of the roughness has wavelengths below two cells. The contact is computed "
        "without this part, so it is too smooth and its pressure peaks are too low.",
        "Take more cells, or a smaller grid.",
    )
    NO_MODE_NEAR = (
        "FS-W010",
        "No natural frequency is near the excitation",
        "The rig has no mode in the range of the excitation, with its joint neither open nor "
        "stuck. It then hardly vibrates.",
        "Check the units of masses, springs and joint stiffness, and the frequencies.",
    )
    UNUSUAL_MATRICES = (
        "FS-W011",
        "Masses or frequencies of the matrices are implausible",
        "The mass or the lowest natural frequency of the imported matrices is far from that of "
        "machine parts. Matrices have no units of their own.",
        "Give the units of the program that wrote the matrices in structure.matrices.units.",
    )
    NOT_REDUCED = (
        "FS-W012",
        "All unknowns of the matrices are kept",
        "The structure is not reduced, and its matrices are dense. Time and memory grow fast with "
        "the number of unknowns.",
        "Name points to keep in structure.retained, and a number of modes in structure.modes.",
    )
    DAMPING_NOT_TAKEN = (
        "FS-W013",
        "A damping matrix in the file may be overlooked",
        "No matrix has a usual name for damping, but one could be it. Without it, only the damping "
        "of the case counts.",
        "Name the matrix in structure.matrices.damping, or ignore the warning.",
    )
    MASSLESS_TOO_LOW = (
        "FS-W014",
        "Parts are taken as massless at too low a frequency",
        "Displacements without mass are in the model only by their stiffness. Near the given limit "
        "this makes them too soft, and natural frequencies are wrong.",
        "Raise structure.massless, or lower the frequencies or harmonics of the motion.",
    )
    EVEN_HARMONICS_MISSING = (
        "FS-W015",
        "Even harmonics are missing",
        "A joint that differs on its two sides makes a motion with even harmonics. Without them "
        "the motion is forced to be symmetric.",
        "List even harmonics in resolution.harmonics.",
    )
    FLANK_LIFTS = (
        "FS-W016",
        "The moment would lift the blade off a flank",
        "The aerodynamic moment exceeds that of the centrifugal pull. One flank would carry "
        "nothing.",
        "Check the unit of the moment, the speed and the mass of the airfoil.",
    )
    UNUSED_CONTENT = (
        "FS-W017",
        "The mesh file has content that is not used",
        "The file has loads, supports, contacts or materials, but a case takes those that it lists "
        "itself.",
        "List them with `fretscale describe FILE`, and add to the case what is missing.",
    )
    READER_REMARK = (
        "FS-W018",
        "The reader of the mesh file printed a message",
        "The library that reads this format found something unusual. Parts of the mesh may be "
        "missing or changed.",
        "Look at the message, and see with `fretscale describe FILE` that the mesh is complete.",
    )
    FOLDED_ELEMENTS = (
        "FS-W019",
        "Midside nodes would fold elements",
        "The surface bends so much within an element that its curved form is invalid. The edges in "
        "question are taken as straight, so the form is less exact there.",
        "Refine the mesh where the surface bends.",
    )
    MIDSIDES_APART = (
        "FS-W020",
        "Midside nodes of matching faces differ",
        "Two faces meet node to node, but not at their midside nodes. The gap there is taken as "
        "zero.",
        "Give both faces the same midside nodes, or take mesh.order: 1.",
    )
    FACES_HARDLY_MEET = (
        "FS-W021",
        "Two contact faces share little area",
        "Most of a face lies beside the other one. Often one of several parts of a face is not "
        "named, and the contact is then too small.",
        "Name all parts of the face in the case.",
    )

    # --- contacts -------------------------------------------------------------------------------
    CONTACT_AT_BORDER = (
        "FS-W101",
        "The contact touches the border of its grid",
        "The contact is cut off at the border, where a false pressure peak arises. Pressure, wear "
        "and stress near the border are wrong.",
        "Enlarge the grid or the face. For tangential loops lower their normal force.",
    )
    FEW_CELLS = (
        "FS-W102",
        "Too few cells lie across the contact",
        "The grid resolves the contact badly. The largest pressure has about the error that the "
        "warning gives, and the width one of a cell.",
        "Take the finer grid that the warning proposes.",
    )
    EDGE_PEAK_MISSED = (
        "FS-W103",
        "The grid misses a pressure peak at an edge",
        "The pressure peak at a rounded edge is narrower than the cells. Peak pressure, and the "
        "wear and life at the edge, are underestimated.",
        "Refine contact.grid, or increase the radius of the edge.",
    )
    PRESSURE_ABOVE_YIELD = (
        "FS-W104",
        "The pressure exceeds the yield stress",
        "Bodies are linear elastic. Real bodies would yield there, and the pressure would be lower "
        "and wider.",
        "Lower the load, or take the pressure as an upper bound. A hardened surface has a higher "
        "yield stress.",
    )
    DISSIMILAR_NEGLECTED = (
        "FS-W105",
        "The coupling of dissimilar materials is neglected",
        "Shear moves the surfaces of dissimilar bodies normally, which contact.method: normal does "
        "not resolve. The error of pressure and slip grows with Dundurs' beta and with friction.",
        "Use contact.method: full.",
    )
    LONG_INCREMENTS = (
        "FS-W106",
        "The increments of the load are too long",
        "Friction depends on the path. Shear and dissipated energy have the errors that the "
        "warning gives.",
        "Take more increments, or let the run split them with contact.history: auto.",
    )
    ENERGIES_DIFFER = (
        "FS-W107",
        "Structure and half-space dissipate different energies",
        "The slip of the structure or of the loads file disagrees with that of the contact grid. "
        "Wear follows this energy, so it is uncertain by as much.",
        "Refine the mesh of the contact faces or use contact.method: full. For a loads file, check "
        "its energies, friction, size and gap.",
    )
    UNCERTAIN_LINK = (
        "FS-W108",
        "The link of structure and contact is uncertain",
        "The bodies deform differently from half-spaces, and the mesh is too coarse to say how "
        "much. Pressures may be wrong by about the error that the warning gives.",
        "Refine the mesh of the contact face.",
    )
    UNKNOWN_SHEAR = (
        "FS-W109",
        "The shear of a sticking contact is unknown",
        "contact.method: normal knows the shear only where a contact slides. The stress lacks it, "
        "and the life leaves out the increments in question.",
        "Use contact.method: full.",
    )
    UNCERTAIN_CARRIED_STRESS = (
        "FS-W110",
        "The stress that the structure carries past a contact is uncertain",
        "The stress under a contact has a part from its tractions and one from the structure. The "
        "mesh is too coarse for the second part.",
        "Refine the mesh of the contact face.",
    )

    # --- structures -----------------------------------------------------------------------------
    CYCLE_NOT_CLOSED = (
        "FS-W201",
        "The load cycle is not closed",
        "The contact forces of a cycle differ from those of the cycle before. Wear repeats this "
        "cycle, so it uses forces that still change.",
        "Compute more cycles before the one that wears.",
    )
    OUT_OF_BALANCE = (
        "FS-W202",
        "Forces on a body are out of balance",
        "The stiffness of peak load does not suit the other increments, so the contact forces "
        "there are wrong by about the imbalance.",
        "Change nonlinearity.stiffness.",
    )
    FACE_OPEN = (
        "FS-W203",
        "A contact face is open",
        "The faces do not touch during the whole cycle, or not at peak load. There is no wear, or "
        "no pressure and stress to show.",
        "Check loads, supports and gap if the faces should touch.",
    )
    FEW_NODES = (
        "FS-W204",
        "Few nodes carry the load",
        "The mesh hardly resolves the contact. Its slip, tilt and deformation depend on the mesh.",
        "Refine the mesh of the contact faces, or take elements of second order.",
    )
    UNCERTAIN_FORM = (
        "FS-W205",
        "The form of a contact face is uncertain",
        "The mesh has only corner nodes, through which the curved form is fitted. The peak "
        "pressure may be wrong by the share that the warning gives.",
        "Give the bodies as CAD, or with midside nodes.",
    )
    UNCERTAIN_NOTCH_STRESS = (
        "FS-W206",
        "The largest stress of a body depends on the mesh",
        "The estimated error of the largest stress on the free surface exceeds the accuracy.",
        "Refine the mesh there, or take elements of second order.",
    )
    UNBOUNDED_STRESS = (
        "FS-W207",
        "The largest stress of a body has no limit",
        "The stress grows without limit as the mesh is refined. The place is next to a sharp "
        "inward corner, a coarse fillet or the end of a held face.",
        "Round the corner, refine the fillet, or hold the body farther away.",
    )
    JOINT_LOCKS = (
        "FS-W208",
        "The joint locks itself",
        "Friction exceeds the tangent of the flank angle. The blade does not move back when the "
        "load falls, so the faces hardly slip.",
        "Check the coefficient of friction and the flank angle.",
    )
    SUPPORT_ON_FACE = (
        "FS-W209",
        "Supports hold nodes of a contact face",
        "The supports are not a plane of symmetry, which the half-space would respect. Its "
        "pressure is that of a face that ends at the support.",
        "Mesh the whole face, or hold a whole plane of symmetry.",
    )
    FRICTION_KEPT = (
        "FS-W210",
        "The structure keeps its first coefficient of friction",
        "Friction evolves in the contacts, but the structure is not solved again. The contact "
        "forces are those of the first coefficient.",
        "Let coupling.resultants update the structure, or accept constant forces.",
    )
    WORN_MESH_SIMPLIFIED = (
        "FS-W211",
        "Written meshes show only the worn shape",
        "Elements are too small for the gap that the case gives to the faces. The written meshes "
        "have the wear, but not the gap; results are not affected.",
        "Coarsen the mesh near the face if the written shape matters.",
    )
    WEAR_OFF_THE_NODES = (
        "FS-W212",
        "Worn nodes carry only a part of the worn volume",
        "A part of the wear lies outside the face whose nodes are written. The file of worn nodes "
        "lacks this volume.",
        "Name a larger face, or take the fields on the grid from results.h5.",
    )
    NO_DENSITY = (
        "FS-W213",
        "A body under rotation or acceleration has no density",
        "The forces of the body's own mass are missing. The contacts carry less than in reality.",
        "Give the material of the body a density.",
    )

    # --- wear -----------------------------------------------------------------------------------
    ACCURACY_EXCEEDED = (
        "FS-W301",
        "Estimated errors exceed the accuracy",
        "The estimated errors of the listed results are larger than `accuracy` of the case allows.",
        "Change the setting that the warning names, or allow a larger error.",
    )
    CHOICE_INACCURATE = (
        "FS-W302",
        "The chosen settings do not meet the accuracy",
        "Even the most accurate settings that may be chosen leave a larger error, or the error of "
        "one of them is unknown. The run uses them.",
        "Allow a larger error, or give the settings yourself.",
    )
    LONG_WEAR_STEPS = (
        "FS-W303",
        "The wear steps are too long",
        "The wear between two solutions of the contact is so large that depth, volume or peak "
        "pressure have the error that the warning gives.",
        "Take shorter steps or a smaller tolerance.",
    )
    UNSTABLE_STEPS = (
        "FS-W304",
        "Explicit wear steps are unstable",
        "The steps exceed their limit of stability and amplify the roughness of the grid. The worn "
        "surface becomes jagged, and its pressures are meaningless.",
        "Use implicit steps, or shorter ones.",
    )
    MANY_STEPS = (
        "FS-W305",
        "The run needs very many wear steps",
        "Each step takes time and space in the results. Accuracy is not affected.",
        "Take larger steps or a larger tolerance.",
    )
    FALSE_EDGES = (
        "FS-W306",
        "Too few increments for bodies that move over each other",
        "Between two increments the surfaces jump, and wear false edges into each other. The worn "
        "peak pressure is too large; no estimate includes this error.",
        "Take as many increments per cycle as the warning names.",
    )
    MOTION_NEGLECTED = (
        "FS-W307",
        "The motion over each other is neglected",
        "The bodies slide by a large share of the contact width, but the model pairs the same "
        "points throughout the cycle. Worn depth is too concentrated.",
        "Lower the force or the stroke, or use a model whose surfaces move (analysis wear).",
    )
    NOT_STEADY = (
        "FS-W308",
        "Wear becomes steady only near the end of the run",
        "The steady value is taken from few points and may still change.",
        "Raise the energy or the number of cycles.",
    )
    FRICTION_CHANGES = (
        "FS-W309",
        "Friction changes faster than the run follows",
        "Cycles are not divided, and the loads of a structure are solved again only after a wear "
        "jump. Energy and wear are computed with a wrong coefficient, and the estimated errors do "
        "not show this.",
        "Take shorter wear jumps where friction changes; let it change over more than one cycle.",
    )

    # --- vibration and time ---------------------------------------------------------------------
    CURVE_ENDS = (
        "FS-W401",
        "A curve ends early",
        "The continuation found no further motion, or the motion is unbounded. The rest of the "
        "curve is missing, perhaps with its resonance.",
        "Add damping or harmonics, or change the range, as the message says.",
    )
    NO_RESONANCE = (
        "FS-W402",
        "The largest motion is at an end of the curve",
        "There is no resonance within the range of frequencies. Resonance frequency, damping and "
        "amplitude are those of the end point.",
        "Widen the range of frequencies.",
    )
    INACCURATE_MOTION = (
        "FS-W403",
        "Harmonics or samples are too few",
        "The motion has the error that the warning gives, above the tolerance.",
        "Give a resolution.tolerance, or more resolution.harmonics and resolution.samples.",
    )
    UNKNOWN_STABILITY = (
        "FS-W404",
        "The stability of motions is unknown",
        "The test of stability succeeded at no point of the curve. Some of its motions may never "
        "occur.",
        "Give more harmonics and samples.",
    )
    FALSE_FOLD = (
        "FS-W405",
        "A fold of the curve is not one of the motion",
        "The curve turns where the stability of the motion does not change. The fold comes from "
        "the finite number of harmonics.",
        "Give more resolution.harmonics and resolution.samples.",
    )
    NO_FURTHER_BRANCH = (
        "FS-W406",
        "No further branch was found",
        "The search for motions beside the main curve ended on known ones, or nowhere. Further "
        "ones may still exist.",
        "Start the search from another place, or accept the result.",
    )
    MOTION_NOT_FOUND = (
        "FS-W407",
        "A motion was not found",
        "The motion or loop at one frequency is missing. The other results are complete.",
        "Choose a frequency within the curve, or more harmonics.",
    )
    LOST_FORCE = (
        "FS-W408",
        "The force has parts above the highest harmonic",
        "This part of the recorded force is left out, and the motion lacks it.",
        "Raise highest, or resolution.harmonics.",
    )
    MODE_TAKEN_AS_RIGID = (
        "FS-W409",
        "A slow mode is taken as a rigid motion",
        "Its frequency is so far below the highest one that rounding hides it. Its stiffness is "
        "taken as zero.",
        "Reduce the structure by structure.retained and structure.modes.",
    )
    LONG_TIME_STEPS = (
        "FS-W410",
        "The time steps are too long",
        "The displacement has the error that the warning gives, estimated from steps of twice the "
        "length.",
        "Take shorter time steps (integration.step).",
    )
    RECORD_ENDS_EARLY = (
        "FS-W411",
        "The record ends before the response",
        "The response to the hammer still rings at the end of the record. This blurs the peaks, "
        "and their damping is too large.",
        "Raise excitation.record.",
    )
    NO_RING_DOWN = (
        "FS-W412",
        "There is no ring-down to evaluate",
        "The free vibration fades before the filter around its mode settles. Frequency and damping "
        "over the amplitude are missing for this state.",
        "Use the frequency response of this state instead.",
    )
    INACCURATE_AGEING = (
        "FS-W413",
        "The ageing is interpolated too coarsely",
        "The steady states between which wear is interpolated are too few for the tolerance.",
        "Allow a larger ageing.tolerance, or shorten the ageing.",
    )
    ENERGY_NOT_REACHED = (
        "FS-W414",
        "The test ends before an energy that was asked for",
        "The joint dissipates less than the listed energies, whose states are missing.",
        "Lengthen the test, or list smaller energies.",
    )
    TABLE_TOO_SHORT = (
        "FS-W415",
        "The table of loops ends early",
        "The joint dissipates more energy than the last loop of the table has. From there on the "
        "last loop is used.",
        "Compute the loops for more cycles.",
    )
    LOOPS_DO_NOT_SLIDE = (
        "FS-W416",
        "Loops of the table do not slide as a whole",
        "Without full sliding, the largest force over the normal load is less than the coefficient "
        "of friction. The joint slides too early.",
        "Compute the loops with a larger loops.amplitude.",
    )
    LOOPS_OF_ANOTHER_LOAD = (
        "FS-W417",
        "Loops of the table are under another load",
        "The stiffness of a contact depends on its normal load, so the joint has a wrong one.",
        "Compute the loops under the load of the joint.",
    )
    NO_FORCE = (
        "FS-W418",
        "Nothing moves",
        "The force is 0 for the whole duration of the motion.",
        "Check when the force begins, and how long the motion is followed.",
    )

    # --- fits and measurements ------------------------------------------------------------------
    CONSPICUOUS_RESIDUALS = (
        "FS-W501",
        "The data do not scatter at random about the fit",
        "Bounds of a fit hold for independent scatter. Groups, waves, outliers or a scatter that "
        "grows suggest a wrong model or mixed data, and bounds that are too small.",
        "Look at the figure of the residuals; separate the data or change the law.",
    )
    RESTS_ON_ONE_VALUE = (
        "FS-W502",
        "A parameter rests on one value",
        "A single measured value decides the parameter. An error of that value moves it fully.",
        "Measure more values in this range.",
    )
    ONLY_A_PRODUCT = (
        "FS-W503",
        "Only a product of parameters is determined",
        "The data determine the product, but neither of its factors.",
        "Fix one of them at a known value, or use the product.",
    )
    WORSE_STARTS = (
        "FS-W504",
        "Some starts ended at a worse fit",
        "The problem has several local minima. The best one found is reported, but a better one "
        "may exist.",
        "Narrow the allowed ranges of the parameters.",
    )
    CONTRADICTING_FILES = (
        "FS-W505",
        "Measured files contradict each other",
        "The values that single files give differ by more than their scatter. The bounds of a "
        "common value are too small.",
        "Fit the files separately, or find what the tests differ in.",
    )
    TOO_FEW_RUNS = (
        "FS-W506",
        "Runs behind a fit are too few or too coarse",
        "The fit interpolates between runs. Further or finer runs still change it, which its "
        "bounds do not include.",
        "Add cases, or refine them.",
    )
    RUNS_WARNED = (
        "FS-W507",
        "Runs behind a fit gave a warning",
        "The warning in question is repeated with its own code. It applies to the parameters of "
        "the fit, too.",
        "Look up the other code.",
    )
    DATA_LEFT_OUT = (
        "FS-W508",
        "Data are left out of a fit",
        "Some loops or columns of the measured files are not used.",
        "Check that the rest is what you meant to fit.",
    )
    CHANGING_LOOPS = (
        "FS-W509",
        "Loops of one stroke change",
        "The joint wears or runs in during the record. One law is then a mean of its states.",
        "Fit parts of the record separately.",
    )
    UNCERTAIN_SCAR = (
        "FS-W510",
        "The error of a measured scar is uncertain",
        "The noise is correlated over a large part of the unworn rim, or both scans agree to the "
        "last digit there. The error of volume and depth is then rough or unknown.",
        "Take scans that reach farther beyond the scar, and check that they are two measurements.",
    )
    NO_WORN_VOLUME = (
        "FS-W511",
        "The measured volume does not differ from zero",
        "The difference of both scans is within its error, or negative.",
        "Check the order of the files.",
    )
    WHOLE_STIFFNESS = (
        "FS-W512",
        "A measured stiffness is taken as that of the law",
        "Measured loops have no residual stiffness, which remains when all points slide. The whole "
        "measured stiffness is taken as that of the law, which is right without a residual.",
        "Measure the residual stiffness, or make sure that there is none.",
    )
    NOT_COMPARED = (
        "FS-W520",
        "A measured or reported value is not compared",
        "The results have no such quantity or curve, or the point lies outside the computed range.",
        "Correct the name of the quantity, or extend the range of the run.",
    )
    EXPECTATION_NOT_MET = (
        "FS-W521",
        "An expectation is not met",
        "A result differs from the value that its case expects by more than the tolerance.",
        "Look at the source of the value, and at other warnings of the run.",
    )

    # --- files and processes --------------------------------------------------------------------
    NOT_WRITTEN = (
        "FS-W901",
        "An optional output failed",
        "A figure, the report, a log or the progress could not be written. The results are "
        "complete.",
        "Write the report again with `fretscale report DIR`. Report the message as a defect if it "
        "comes again.",
    )
    FOREIGN_FILES = (
        "FS-W902",
        "The folder has files that are not part of the run",
        "Files were in the folder before. Files whose names the run needs are renamed.",
        "Move or delete them if they are not needed.",
    )
    DAMAGED_CACHE = (
        "FS-W903",
        "A file of the cache is damaged",
        "The stored structure is not used, but computed again. Results are not affected.",
        "Nothing has to be done. If it happens often, check the disk.",
    )
    NO_WORKER = (
        "FS-W904",
        "The cluster has no worker",
        "Runs wait for a worker. After an hour without any they are given up; finished runs are "
        "kept.",
        "See that the scheduler starts workers, or end the command with Ctrl-C.",
    )


class Notice(NamedTuple):
    """A warning as a value: its kind and its text, which shows with the code at its end."""

    kind: WarningKind
    text: str

    def __str__(self) -> str:
        return self.kind.marked(self.text)


def kinds_in(texts: Iterable[str]) -> list[WarningKind]:
    """Return the kinds whose codes are in the texts of warnings, in order and each once."""
    codes = {kind.code: kind for kind in WarningKind}
    found = (code for text in texts for code in PATTERN.findall(text))
    return list(dict.fromkeys(codes[code] for code in found if code in codes))
