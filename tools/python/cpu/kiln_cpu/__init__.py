"""An OpenCL device of the CPU: PoCL, with compiler, linker and kernel library inside. Kiln finds it by itself."""

from pathlib import Path

# : Path of the driver's library, as a value for KILN_OPENCL_DRIVER, or for OCL_ICD_VENDORS of ocl-icd.
library = str(Path(__file__).parent / "lib" / "libpocl.so")
