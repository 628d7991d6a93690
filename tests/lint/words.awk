# Fails where a sentence is too long to be read once: of a README, or of a comment in a source. A
# sentence ends at . ! ? : or ; and at the edge of a table's cell, a list's item or a comment. A name in code
# counts one word; blocks of code, brackets and addresses of links count nothing.
#
# Run as: awk -v limit=<words> -f words.awk FILE...
function judge(text, place,    count, i, k, parts, sentences, word, words) {
  gsub(/`[^`]*`/, "x", text)
  gsub(/\]\([^)]*\)/, "", text)
  while (gsub(/\([^()]*\)/, "", text)) {}
  gsub(/[.!?:;][*"]* /, "&\n", text)
  gsub(/[|]/, "\n", text)
  count = split(text, sentences, "\n")
  for (i = 1; i <= count; ++i) {
    words = 0
    parts = split(sentences[i], word, /[ \t]+/)
    for (k = 1; k <= parts; ++k) words += word[k] ~ /[A-Za-z0-9]/
    ++all
    if (words > limit) {
      printf "%s: %d words, at most %d: %s\n", place, words, limit, sentences[i]
      bad = 1
    }
  }
}
# The comment that was gathered so far ends here.
function finish() {
  if (comment != "") judge(comment, begun)
  comment = mark = ""
}
FNR == 1 { finish(); code = 0 }
FILENAME ~ /\.(h|cpp|cl|clh)$/ {
  if (!match($0, /\/\/\/?<?/)) { finish(); next }
  before = substr($0, 1, RSTART - 1)
  text = substr($0, RSTART + RLENGTH)
  # A line goes on with the comment above, but after code, with another mark, as a command or as an item "name  text".
  if (before ~ /[^ ]/ || substr($0, RSTART, RLENGTH) != mark || text ~ /^ *([\\-]|$)/ || text ~ /^  +[^ ].*[^ ]  /) finish()
  mark = substr($0, RSTART, RLENGTH)
  sub(/^ *\\[a-z]+ /, "", text)
  if (comment == "") begun = FILENAME ":" FNR
  comment = comment " " text
  next
}
/^[ \t]*```/ { code = !code; next }
code || /^#/ || /^!\[/ || /^<!--/ { next }
{ judge($0, FILENAME ":" FNR) }
END {
  finish()
  if (all == 0) print "no sentence was read"
  printf "%d sentences of at most %d words\n", all, limit
  exit bad || all == 0
}
