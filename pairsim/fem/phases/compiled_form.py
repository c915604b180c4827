"""A form that FFCx compiles once, without a mesh, and that is then used on many meshes."""

from __future__ import annotations

import sysconfig
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ffcx.naming
import ffcx.options
import ufl
from cffi import VerificationError
from ufl.algorithms.analysis import extract_coefficients, extract_constants

from pairsim.fem.compilation.jit import JIT_OPTIONS, in_cache
from pairsim.runtime.errors import EnvironmentFailure
from pairsim.runtime.fenicsx import MPI, dolfinx

fem = dolfinx.fem


@dataclass(frozen=True, eq=False)
class CompiledForm:
    """A compiled form with its coefficients and constants.

    `dolfinx.fem.create_form` searches the expressions of the form for these at each call, which takes two thirds of the
    time needed to set up a viscoelastic liquid on a small mesh. Here they are found once.

    Attributes:
        form: The form as DOLFINx has compiled it.
        coefficients: Its coefficients, in the order of the compiled form.
        constants: Its constants, in that order.
    """

    form: Any
    coefficients: tuple[ufl.Coefficient, ...]
    constants: tuple[ufl.Constant, ...]

    @property
    def kernel(self) -> int:
        """Address of the function that integrates over a cell."""
        integral = self.form.ufcx_form.form_integrals[0]
        return int(self.form.module.ffi.cast("uintptr_t", integral.tabulate_tensor_float64))

    def on(self, spaces: Sequence[Any], functions: Mapping[Any, Any], constants: Mapping[Any, Any]) -> Any:
        """The form of DOLFINx on a mesh.

        Args:
            spaces: Function spaces on this mesh, one for each argument of the form.
            functions: A function on it for each coefficient.
            constants: A constant on it for each constant of the form.
        """
        ffi, ufcx_form = self.form.module.ffi, self.form.ufcx_form
        form = dolfinx.cpp.fem.create_form_float64(
            ffi.cast("uintptr_t", ffi.addressof(ufcx_form)),
            [space._cpp_object for space in spaces],
            {f"w{i}": functions[each]._cpp_object for i, each in enumerate(self.coefficients)},
            {f"c{i}": constants[each]._cpp_object for i, each in enumerate(self.constants)},
            {},
            [],
            spaces[0].mesh._cpp_object,
        )
        return fem.Form(form, ufcx_form, self.form.code, self.form.module)


def compiled(form: ufl.Form) -> CompiledForm:
    """Compile a form by FFCx, or load it from the cache.

    Each form has its own folder in the cache, named by a hash of all that determines FFCx's name of the module. FFCx
    therefore either finds the whole module, or compiles it in a folder that no other process reads.

    Raises:
        EnvironmentFailure: There is no compiler, it failed, or the cache cannot be written to.
    """
    options = {name: value for name, value in dolfinx.jit.get_options(JIT_OPTIONS).items() if name != "cache_dir"}
    python = sysconfig.get_config_vars("CFLAGS", "SOABI")
    name = ffcx.naming.compute_signature([form], str((options, ffcx.options.get_options(), python)))

    def load(folder: Path) -> Any:
        try:
            return fem.compile_form(MPI.COMM_SELF, form, jit_options={**options, "cache_dir": str(folder)})
        except VerificationError as error:
            raise EnvironmentFailure(f"the forms cannot be compiled: {error}", advice="pairsim doctor") from error

    found, known = load(in_cache(f"form-{name}", load)), extract_coefficients(form)
    order = found.ufcx_form.original_coefficient_positions
    used = tuple(known[order[i]] for i in range(found.ufcx_form.num_coefficients))
    return CompiledForm(found, used, tuple(extract_constants(form)))
