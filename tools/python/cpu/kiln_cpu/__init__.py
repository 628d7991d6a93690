"""An OpenCL device of the CPU: PoCL, with compiler, linker and kernel library inside. Kiln finds it by itself."""

from pathlib import Path

#: Path of the driver's library: what KILN_OPENCL_DRIVER, or OCL_ICD_VENDORS of ocl-icd, may be set to.
library = str(Path(__file__).parent / "lib" / "libpocl.so")
