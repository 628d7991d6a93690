import kiln
glb = kiln.to_glb("statue.glb", faces_target=5000, path="game.glb")
print(f"{len(glb.faces)} triangles, {len(glb.data)} bytes")
