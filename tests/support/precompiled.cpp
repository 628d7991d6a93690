// An empty file: its target precompiles the headers that every test includes.
