"""Kinds of errors that end a command, and the kind of an exception.

E0xx are about what was given, E1xx about models and methods, E2xx about the machine. New kinds get
new numbers, and a number is never used again.
"""

from __future__ import annotations

from enum import unique

from sa_solver.errors import FretscaleError
from workflow.messages.kinds import MessageKind


@unique
class ErrorKind(MessageKind):
    """Kind of error. A command ends with it, and with an exit code."""

    # --- what was given -------------------------------------------------------------------------
    REFUSED = (
        "FS-E001",
        "An argument, entry or file is refused",
        "The command cannot do what was asked. The message names the argument, entry or file, what "
        "is wrong with it, and usually what is allowed.",
        "Change what the message names. `fretscale COMMAND --help` lists the arguments.",
    )
    CASE_REFUSED = (
        "FS-E002",
        "A case is refused",
        "The case file is not valid YAML, has an unknown or missing entry, or has values that are "
        "not allowed. Each line names file, line and entry. Nothing was computed.",
        "Correct the entries. `fretscale new KIND` prints a commented case.",
    )
    FILE_UNUSABLE = (
        "FS-E003",
        "A file or folder cannot be read or written",
        "The operating system refuses it: it does not exist, is of the wrong kind, or access is "
        "not permitted.",
        "Check path and permissions.",
    )
    INPUT_FILE_REFUSED = (
        "FS-E004",
        "A file that a case names is refused",
        "A table, heights, scan, loads or loops file is missing, or its contents do not fit. The "
        "message names file and line.",
        "Correct the file or the entry that names it.",
    )
    MESH_REFUSED = (
        "FS-E005",
        "A mesh or CAD file is refused",
        "The file cannot be read, lacks a group that the case names, has elements that are not "
        "supported, or its faces do not meet.",
        "See with `fretscale describe FILE` what is in it, and correct the file or the names.",
    )
    MATRICES_REFUSED = (
        "FS-E006",
        "Matrices of another program are refused",
        "Files of matrices are unreadable, do not fit each other, or do not describe a structure "
        "that is fixed where the case says.",
        "Correct the files, or the entries in structure that describe them.",
    )
    FOLDER_IN_USE = (
        "FS-E007",
        "A folder is in use",
        "Another process computes in this folder.",
        "Wait for its end, or give another folder.",
    )
    FOLDER_TAKEN = (
        "FS-E008",
        "A folder or file exists already",
        "The command would overwrite results, or files that are not its own.",
        "Give another name. `--force` overwrites results of an earlier command.",
    )
    RUN_CHANGED = (
        "FS-E009",
        "A stored run cannot be used",
        "Files of the run or of its input are missing, damaged, changed since, or of another "
        "version of fretscale, or there is no finished run.",
        "Put the files back, or run the case again.",
    )
    EXPECTATION_MISSED = (
        "FS-E010",
        "An expectation is missed",
        "A result is outside the tolerance around the value that a case expects.",
        "Look at the table of `fretscale verify`, and at the warnings of the run.",
    )

    # --- models and methods ---------------------------------------------------------------------
    INVALID_MODEL = (
        "FS-E101",
        "The model is not valid",
        "Values do not fit together, or are outside what a model can describe.",
        "Change the values that the message names.",
    )
    NO_SOLUTION = (
        "FS-E102",
        "A contact problem has no solution",
        "No pressure and shear can carry the loads. For example, a tangential force exceeds "
        "friction, or bodies are pulled apart.",
        "Change the loads, or impose displacements instead of forces.",
    )
    NOT_CONVERGED = (
        "FS-E103",
        "A method did not converge",
        "A solution may exist, but the iterations did not find it. The message has the residual "
        "and what to change. Earlier steps of the run are stored.",
        "Follow the advice of the message: finer increments, shorter steps, or other loads.",
    )
    NOT_SOLVABLE = (
        "FS-E104",
        "The equations of a structure cannot be solved",
        "The stiffness matrix is singular or nearly so. Most often a body can move freely.",
        "Check supports, contacts and materials.",
    )
    TOO_COARSE = (
        "FS-E105",
        "A contact is a single point of its grid",
        "So few cells or nodes carry the load that size and pressure of the contact are "
        "meaningless.",
        "Take a finer grid or mesh, or a smaller grid.",
    )
    FIT_REFUSED = (
        "FS-E106",
        "A fit is not possible",
        "The data are too few, or do not contain what the law needs.",
        "Add measurements, or hold parameters at known values.",
    )

    RUNS_FAILED = (
        "FS-E107",
        "Some of several runs failed",
        "A sweep or a chart lacks runs that failed. The table gives the error of each with its own "
        "code; the other runs are complete.",
        "Look up the codes of the failed runs. The same command tries them again.",
    )

    # --- machine --------------------------------------------------------------------------------
    OUT_OF_MEMORY = (
        "FS-E201",
        "There is not enough memory",
        "The case needs more memory than is free. The estimate is made before the run where it can "
        "be.",
        "Take a coarser mesh or grid, or another computer.",
    )
    OUTPUT_FAILED = (
        "FS-E202",
        "Output cannot be written",
        "The disk or quota is full, or a device failed. Earlier output is complete.",
        "Free space, and continue with `fretscale resume DIR` or the same command.",
    )
    INTERRUPTED = (
        "FS-E203",
        "The command was interrupted",
        "Ctrl-C or a batch system ended it. Results so far are stored.",
        "Continue with `fretscale resume DIR`, or with the same command for several runs.",
    )
    PROCESS_LOST = (
        "FS-E204",
        "A process of the run ended unexpectedly",
        "A worker process is gone. Most often the system ended it because memory ran out.",
        "Free memory, use fewer processes, and continue the run.",
    )
    CLUSTER_LOST = (
        "FS-E205",
        "The cluster is gone",
        "The scheduler or all of its workers disappeared. Finished runs are stored.",
        "Start the cluster again, and give the same command.",
    )
    PACKAGE_MISSING = (
        "FS-E206",
        "A package of the system is missing",
        "A library that fretscale needs is not installed.",
        "Install what the message names.",
    )
    DEFECT = (
        "FS-E207",
        "A run failed unexpectedly",
        "An error occurred that fretscale does not know, most probably a defect. The log of the "
        "run has the details.",
        "Report it with the case and the log.",
    )


# Exceptions by the names of their classes, which are unique, because most of their modules are slow
# to import. An exception has the kind of its class or of the nearest base class here.
KINDS = {
    "CaseError": ErrorKind.CASE_REFUSED,
    "EntryError": ErrorKind.CASE_REFUSED,
    "InputFileError": ErrorKind.INPUT_FILE_REFUSED,
    "MeasuredLoopError": ErrorKind.INPUT_FILE_REFUSED,
    "MeshError": ErrorKind.MESH_REFUSED,
    "NotTakenError": ErrorKind.MESH_REFUSED,
    "MatrixError": ErrorKind.MATRICES_REFUSED,
    "FolderInUse": ErrorKind.FOLDER_IN_USE,
    "FolderTaken": ErrorKind.FOLDER_TAKEN,
    "RunChanged": ErrorKind.RUN_CHANGED,
    "ExpectationMissed": ErrorKind.EXPECTATION_MISSED,
    "ContactProblemError": ErrorKind.NO_SOLUTION,
    "SolverError": ErrorKind.NOT_SOLVABLE,
    "PardisoError": ErrorKind.NOT_SOLVABLE,
    "RunsFailed": ErrorKind.RUNS_FAILED,
    "TooCoarse": ErrorKind.TOO_COARSE,
    "FitError": ErrorKind.FIT_REFUSED,
    "FactorMemoryError": ErrorKind.OUT_OF_MEMORY,
    "OutOfMemory": ErrorKind.OUT_OF_MEMORY,
    "NotWritten": ErrorKind.OUTPUT_FAILED,
    "ProcessLost": ErrorKind.PROCESS_LOST,
    "ClusterLost": ErrorKind.CLUSTER_LOST,
    "ConvergenceError": ErrorKind.NOT_CONVERGED,
    "MethodFailed": ErrorKind.NOT_CONVERGED,
    "UserError": ErrorKind.REFUSED,
    "InputError": ErrorKind.INVALID_MODEL,
    "FretscaleError": ErrorKind.NOT_CONVERGED,
}
# Kinds that say little: an exception of one of these has the kind of the error that caused it.
GENERAL = ErrorKind.REFUSED, ErrorKind.NOT_CONVERGED


def error_kind(error: FretscaleError) -> ErrorKind:
    """Return the kind of an exception that ends a command."""
    kind = next(KINDS[base.__name__] for base in type(error).__mro__ if base.__name__ in KINDS)
    cause = error.__cause__
    if kind in GENERAL and isinstance(cause, FretscaleError):
        return error_kind(cause)
    return kind
