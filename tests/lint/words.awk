# Fails where a sentence of a README is too long to be read once. A sentence ends at . ! ? : or ; and at the edge
# of a table's cell. A name in code counts one word; blocks of code, brackets and addresses of links count nothing.
#
# Run as: awk -v limit=<words> -f words.awk FILE...
FNR == 1 { code = 0 }
/^[ \t]*```/ { code = !code; next }
code || /^#/ || /^!\[/ || /^<!--/ { next }
{
  text = $0
  gsub(/`[^`]*`/, "x", text)
  gsub(/\]\([^)]*\)/, "", text)
  gsub(/\([^()]*\)/, "", text)
  gsub(/[.!?:;][*"]* /, "&\n", text)
  gsub(/[|]/, "\n", text)
  count = split(text, sentences, "\n")
  for (i = 1; i <= count; ++i) {
    words = 0
    parts = split(sentences[i], word, /[ \t]+/)
    for (k = 1; k <= parts; ++k) words += word[k] ~ /[A-Za-z0-9]/
    ++all
    if (words > limit) {
      printf "%s:%d: %d words, at most %d: %s\n", FILENAME, FNR, words, limit, sentences[i]
      bad = 1
    }
  }
}
END {
  if (all == 0) print "no sentence was read"
  printf "%d sentences of at most %d words\n", all, limit
  exit bad || all == 0
}
