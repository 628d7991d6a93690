// Above mesh/.
