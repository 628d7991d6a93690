# Which files of the library are compiled as one (kiln_compile_together), by how much of a command's time they take.
# Headers and templates take longer than most files do, so groups are few, and about equal for two processors.
# Two files of a group have no private name in common; which rooms they are of does not matter.

# What bakes, low polys, volumes and files spend their time in, by a profile of seven commands.
kiln_compile_together(host hot_1
  accel/bvh.cpp accel/bvh_refit.cpp detail/hemisphere_map.cpp detail/point_map.cpp detail/registry.cpp
  detail/transfer.cpp io/image/exr.cpp io/image/image_io.cpp io/image/png_read.cpp io/image/png_write.cpp
  io/image/run_deflate.cpp lowpoly/box_packing.cpp lowpoly/chart_trims.cpp lowpoly/collapse.cpp
  lowpoly/flat_solvers.cpp lowpoly/keep_colors.cpp lowpoly/simplify_check.cpp lowpoly/texel_detail.cpp
  volume/atlas.cpp volume/fine_mesh.cpp)
kiln_compile_together(host hot_2
  image/mips.cpp image/pixels.cpp image/texture_filter.cpp io/mesh/mesh_ply.cpp io/mesh/obj_writer.cpp
  io/mesh/polygon.cpp lowpoly/bitmap_packing.cpp lowpoly/chart_cuts.cpp lowpoly/chart_growth.cpp
  lowpoly/chart_sheet.cpp lowpoly/flat_chart.cpp lowpoly/flat_predicates.cpp mesh/curvature.cpp
  mesh/dense_normals.cpp mesh/fans.cpp mesh/polygon_weights.cpp mesh/weld.cpp volume/normal_splat.cpp
  volume/qef.cpp volume/voxels.cpp)
kiln_compile_together(host hot_3
  accel/bvh_merge.cpp accel/bvh_nodes.cpp accel/raster_chunks.cpp image/srgb.cpp lowpoly/cell_rows.cpp
  lowpoly/chart_borders.cpp lowpoly/chart_mask.cpp lowpoly/chart_surface.cpp lowpoly/collapse_mesh.cpp
  lowpoly/height_field.cpp lowpoly/simplify_input.cpp lowpoly/surface_fit.cpp mesh/surface_distance.cpp
  mesh/surface_links.cpp mesh/tangent.cpp mesh/uv_copies.cpp texel/correspondence.cpp texel/texel_bins.cpp
  texel/texel_pieces.cpp texel/texels.cpp volume/cell_grid.cpp volume/fine_contour.cpp volume/vertex_tree.cpp)
kiln_compile_together(host hot_4
  bake/layers.cpp bake/recall.cpp image/compare.cpp image/gutter.cpp image/push_pull.cpp
  io/mesh/mesh_builder.cpp io/mesh/mesh_obj.cpp io/mesh/mesh_off.cpp io/mesh/mesh_stl.cpp
  lowpoly/collapse_shape.cpp lowpoly/head_start.cpp lowpoly/quadric.cpp mesh/frame.cpp mesh/normals.cpp
  mesh/parts.cpp volume/contour.cpp volume/extract.cpp volume/hermite.cpp volume/light_surface.cpp
  volume/seams.cpp volume/sheets.cpp)

# What plans, checks, reports, and tells devices what to do: each file less than a hundredth of a command's time.
kiln_compile_together(host cold_1
  accel/closest.cpp accel/device_bvh.cpp accel/raster.cpp accel/ray.cpp bake/attribute.cpp bake/check.cpp
  bake/errors.cpp bake/match_alone.cpp bake/report.cpp bake/session_texels.cpp base/error.cpp base/memory.cpp
  base/normal_angle.cpp base/parallel.cpp base/voxel_type.cpp cl/device.cpp cl/watch.cpp io/file/bounds.cpp
  io/file/byte_source.cpp io/file/files.cpp io/image/png_check.cpp lowpoly/height_rule.cpp
  lowpoly/keep_names.cpp lowpoly/layout_rule.cpp lowpoly/unwrap.cpp match/along_visibility.cpp match/axis.cpp
  match/cage_search.cpp match/closest.cpp match/ray.cpp match/registry.cpp match/saved.cpp match/uv_layout.cpp
  match/uv_points.cpp match/view_plan.cpp measure/depth.cpp measure/light_plan.cpp measure/normal_probe.cpp
  measure/probe_places.cpp render/render.cpp)
kiln_compile_together(host cold_2
  bake/find_cage.cpp bake/reasons.cpp bake/session_source.cpp bake/switches.cpp bake/view_session.cpp
  base/heartbeat.cpp cl/binary_cache.cpp cl/context.cpp detail/color.cpp detail/curvature.cpp
  detail/distance.cpp detail/hemisphere_views.cpp detail/hemispheres_groups.cpp detail/hemispheres_more.cpp
  detail/normal.cpp detail/own.cpp detail/position.cpp detail/provenance.cpp detail/uv.cpp
  detail/vertex_color.cpp io/image/cluster_io.cpp io/image/exr_check.cpp io/image/exr_header.cpp
  io/image/exr_layers.cpp io/image/match_io.cpp io/volume/nrrd_axes.cpp lowpoly/chart_density.cpp
  lowpoly/simplify.cpp match/cage_reach.cpp match/low_rays.cpp match/visibility_clusters.cpp
  match/visibility_field.cpp measure/assess.cpp measure/assess_samples.cpp measure/light_check.cpp
  measure/light_model.cpp mesh/cage.cpp mesh/hard_edges.cpp mesh/open_sheets.cpp mesh/smoothing_groups.cpp
  mesh/uv_grid.cpp mesh/uv_squares.cpp source/dense_mesh.cpp source/dense_uvs.cpp source/progress_scope.cpp
  texel/edge_turn.cpp texel/sheet_reach.cpp)
kiln_compile_together(host cold_3
  bake/bake.cpp bake/fallback_blend.cpp bake/map_units.cpp bake/session.cpp cl/driver.cpp cl/opencl.cpp
  cl/program.cpp detail/ao.cpp detail/band_reads.cpp detail/hemispheres.cpp detail/id_colors.cpp
  detail/share_filter.cpp detail/slope.cpp detail/visibility.cpp detail/wireframe.cpp image/value_range.cpp
  io/volume/volume_io.cpp io/volume/volume_nrrd.cpp io/volume/volume_nrrd_write.cpp lowpoly/simplify_job.cpp
  match/cage_shells.cpp match/fallback.cpp match/match_array.cpp match/part_matcher.cpp
  match/surface_places.cpp match/uv.cpp match/visibility_corners.cpp measure/bounds.cpp measure/lod.cpp
  mesh/charts.cpp mesh/low_shading.cpp mesh/low_surface.cpp mesh/soft_seams.cpp render/camera.cpp
  render/frames.cpp)
kiln_compile_together(host cold_4
  detail/cut_out.cpp io/file/atomic_file.cpp io/file/output_set.cpp io/file/placing.cpp io/file/temporary.cpp
  io/mesh/materials.cpp io/mesh/mesh_io.cpp io/mesh/mesh_openmesh.cpp io/mesh/mesh_tangents.cpp
  io/mesh/ply_header.cpp io/mesh/polygon_rules.cpp io/volume/volume_nifti.cpp io/volume/volume_vdb.cpp
  io/volume/volume_vdb_frame.cpp io/volume/volume_voxels.cpp lowpoly/hull_rule.cpp lowpoly/layout_borders.cpp
  lowpoly/pairing.cpp lowpoly/unwrap_charts.cpp measure/light_bytes.cpp measure/measure.cpp
  texel/validate_match.cpp volume/gradient.cpp volume/outer.cpp volume/patches.cpp)
kiln_compile_together(host cold_5
  accel/depth_views.cpp bake/match_stage.cpp bake/pipeline.cpp bake/recall_report.cpp detail/bent_normal.cpp
  detail/displacement.cpp detail/height.cpp detail/hemispheres_cast.cpp detail/hemispheres_views.cpp
  detail/id.cpp detail/low_frames.cpp detail/mask.cpp detail/shadow.cpp detail/surface_texture.cpp
  detail/thickness.cpp io/mesh/mesh_mtl.cpp io/volume/volume_meta.cpp lowpoly/packing.cpp
  lowpoly/unwrap_pairs.cpp match/bevel.cpp match/far_rays.cpp match/outermost.cpp match/second_look.cpp
  match/views.cpp match/visibility.cpp measure/assess_rays.cpp measure/assess_uniformity.cpp
  measure/light_looks.cpp measure/plan.cpp measure/probe_least.cpp measure/probe_pictures.cpp
  measure/screen_pictures.cpp mesh/join_meshes.cpp mesh/mesh_view.cpp mesh/usable.cpp mesh/validate_mesh.cpp
  volume/chart_map.cpp volume/session.cpp volume/short_edges.cpp)
# No command is faster where these are optimised further. Builds that ask for less keep what they ask for.
if(CMAKE_CXX_FLAGS_RELEASE MATCHES "-O[23]")
  foreach(number RANGE 1 5)
    set_source_files_properties(
      ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/kiln.dir/Unity/unity_cold_${number}_cxx.cxx
      PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>)
  endforeach()
endif()
