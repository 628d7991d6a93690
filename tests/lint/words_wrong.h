/// Short enough. This comment has a sentence that begins in one line, goes on in the next line, and so grows
/// to five words more than twenty.
/// \throws Error(input): a command begins a sentence of its own
int long_winded;  ///< So does a comment after code
