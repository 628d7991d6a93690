# Which files of the library are compiled as one (kiln_compile_together), by how much of a bake's time they take.
# Headers take longer than most files do, so groups are few, and about equal for two processors. Two files of a
# group have no private name in common; which rooms they are of does not matter.

kiln_compile_together(host hot_1
  lowpoly/bitmap_packing.cpp lowpoly/box_packing.cpp lowpoly/cell_rows.cpp lowpoly/chart_borders.cpp
  lowpoly/chart_cut_search.cpp lowpoly/chart_cuts.cpp lowpoly/chart_density.cpp lowpoly/chart_growth.cpp
  lowpoly/chart_mask.cpp
  lowpoly/chart_surface.cpp lowpoly/chart_trims.cpp lowpoly/collapse.cpp lowpoly/collapse_costs.cpp
  lowpoly/collapse_mesh.cpp lowpoly/collapse_planes.cpp
  lowpoly/collapse_shape.cpp lowpoly/flat_chart.cpp lowpoly/flat_predicates.cpp lowpoly/flat_solvers.cpp
  mesh/surface_links.cpp mesh/validate_mesh.cpp)
kiln_compile_together(host hot_2
  detail/displacement.cpp detail/hemispheres_cast.cpp detail/mask.cpp detail/own.cpp detail/point_map.cpp
  detail/transfer.cpp detail/wireframe.cpp io/mesh/materials.cpp io/mesh/mesh_builder.cpp io/mesh/mesh_io.cpp
  io/mesh/mesh_obj.cpp io/mesh/mesh_off.cpp io/mesh/mesh_openmesh.cpp io/mesh/mesh_ply.cpp
  io/mesh/mesh_stl.cpp io/mesh/mesh_tangents.cpp io/mesh/obj_writer.cpp io/mesh/ply_header.cpp
  io/mesh/polygon.cpp io/mesh/polygon_rules.cpp)
kiln_compile_together(host hot_3
  mesh/bend_tree.cpp mesh/cage.cpp mesh/charts.cpp mesh/curvature.cpp mesh/fans.cpp mesh/join_meshes.cpp
  mesh/low_shading.cpp mesh/low_surface.cpp mesh/normals.cpp mesh/open_sheets.cpp
  mesh/polygon_weights.cpp mesh/surface_deviation.cpp mesh/surface_distance.cpp mesh/tangent.cpp mesh/usable.cpp mesh/uv_copies.cpp
  mesh/uv_grid.cpp mesh/uv_squares.cpp mesh/weld.cpp)
kiln_compile_together(host hot_4
  volume/atlas.cpp volume/cell_grid.cpp volume/chart_map.cpp volume/contour.cpp volume/extract.cpp
  volume/fine_contour.cpp volume/fine_mesh.cpp volume/hermite.cpp volume/normal_splat.cpp volume/patches.cpp
  volume/qef.cpp volume/seams.cpp volume/sheets.cpp volume/vertex_tree.cpp volume/voxels.cpp)
kiln_compile_together(host hot_5
  io/image/cluster_io.cpp io/image/exr.cpp io/image/exr_check.cpp io/image/exr_header.cpp
  io/image/image_io.cpp io/image/match_io.cpp io/image/png_read.cpp io/image/png_write.cpp render/camera.cpp
  render/frames.cpp volume/light_patch.cpp volume/light_surface.cpp)
kiln_compile_together(host hot_6
  accel/bvh.cpp accel/bvh_guards.cpp accel/bvh_merge.cpp accel/bvh_nodes.cpp accel/bvh_refit.cpp
  accel/bvh_split.cpp accel/closest.cpp accel/depth_views.cpp accel/device_bvh.cpp accel/guard_prism.cpp accel/raster_chunks.cpp accel/ray.cpp measure/assess_samples.cpp
  measure/normal_probe.cpp measure/probe_pictures.cpp measure/probe_places.cpp)
kiln_compile_together(host hot_7
  measure/assess.cpp measure/assess_rays.cpp measure/assess_uniformity.cpp measure/bounds.cpp
  measure/depth.cpp measure/measure.cpp measure/probe_least.cpp measure/screen_pictures.cpp plan/candidate.cpp
 plan/level_evaluator.cpp plan/lods.cpp lowpoly/low_poly_bytes.cpp plan/low_poly_plan.cpp
  plan/match_plan.cpp)
kiln_compile_together(host hot_8
  detail/ao.cpp detail/band_reads.cpp detail/bent_normal.cpp detail/color.cpp detail/cut_out.cpp
  detail/distance.cpp detail/height.cpp detail/hemisphere_views.cpp detail/hemispheres.cpp
  detail/id_colors.cpp detail/low_frames.cpp detail/position.cpp detail/provenance.cpp detail/registry.cpp
  detail/shadow.cpp detail/share_filter.cpp detail/slope.cpp detail/surface_texture.cpp detail/thickness.cpp
  detail/uv.cpp detail/vertex_color.cpp detail/visibility.cpp texel/correspondence.cpp texel/edge_turn.cpp
  texel/sheet_reach.cpp texel/texel_bins.cpp texel/texel_pieces.cpp texel/texels.cpp texel/validate_match.cpp)
kiln_compile_together(host hot_9
  image/push_pull.cpp image/texture_filter.cpp io/image/exr_layers.cpp io/image/png_check.cpp
  io/image/run_deflate.cpp lowpoly/chart_sheet.cpp lowpoly/keep_colors.cpp lowpoly/layout_rule.cpp
  lowpoly/simplify_check.cpp)
kiln_compile_together(host hot_10
  lowpoly/crumbs.cpp lowpoly/head_start.cpp lowpoly/label_seams.cpp lowpoly/height_field.cpp lowpoly/height_rule.cpp lowpoly/hull_rule.cpp
  lowpoly/inside_out.cpp lowpoly/keep_names.cpp lowpoly/layout_borders.cpp lowpoly/packing.cpp lowpoly/pairing.cpp
  lowpoly/quadric.cpp lowpoly/simplify.cpp lowpoly/simplify_input.cpp lowpoly/simplify_job.cpp lowpoly/simplify_labels.cpp
  lowpoly/simplify_sides.cpp
  lowpoly/surface_fit.cpp lowpoly/texel_detail.cpp lowpoly/unwrap.cpp)
kiln_compile_together(host hot_11
  accel/raster.cpp mesh/dense_normals.cpp mesh/frame.cpp mesh/parts.cpp source/dense_mesh.cpp
  source/dense_uvs.cpp source/progress_scope.cpp volume/gradient.cpp volume/outer.cpp volume/session.cpp)
kiln_compile_together(host hot_12
  bake/recall.cpp image/compare.cpp image/gutter.cpp image/mips.cpp image/pixels.cpp image/srgb.cpp
  image/value_range.cpp lowpoly/unwrap_pairs.cpp)
kiln_compile_together(host hot_13
  lowpoly/unwrap_charts.cpp mesh/mesh_view.cpp mesh/soft_seams.cpp mesh/two_sided.cpp render/render.cpp volume/short_edges.cpp)
kiln_compile_together(host hot_14
  io/volume/nrrd_axes.cpp io/volume/volume_io.cpp io/volume/volume_nrrd_write.cpp io/volume/volume_vdb.cpp
  io/volume/volume_vdb_frame.cpp io/volume/volume_voxels.cpp)

# What checks, reports, and tells devices what to do: less than a hundredth of a bake's time.
kiln_compile_together(host cold_1
  cl/binary_cache.cpp cl/context.cpp cl/device.cpp cl/driver.cpp cl/opencl.cpp cl/program.cpp
  cl/watch.cpp io/file/atomic_file.cpp io/file/bounds.cpp io/file/byte_source.cpp io/file/files.cpp
  io/file/output_set.cpp io/file/placing.cpp io/file/temporary.cpp io/volume/volume_nrrd.cpp)
kiln_compile_together(host cold_2
  bake/attribute.cpp bake/bake.cpp bake/check.cpp bake/errors.cpp bake/fallback_blend.cpp bake/find_cage.cpp
  bake/layers.cpp bake/map_units.cpp bake/match_alone.cpp bake/match_stage.cpp bake/recall_report.cpp
  bake/report.cpp bake/session.cpp bake/session_source.cpp bake/session_texels.cpp bake/switches.cpp
  base/error.cpp base/heartbeat.cpp base/memory.cpp base/normal_angle.cpp base/parallel.cpp
  base/voxel_type.cpp)
kiln_compile_together(host cold_3
  io/volume/volume_meta.cpp match/along_visibility.cpp match/bevel.cpp match/cage_shells.cpp
  match/low_rays.cpp match/match_array.cpp match/registry.cpp match/surface_places.cpp match/uv_layout.cpp
  match/visibility.cpp match/visibility_clusters.cpp match/visibility_corners.cpp match/visibility_field.cpp)
kiln_compile_together(host cold_4
  detail/curvature.cpp detail/hemisphere_map.cpp detail/hemispheres_groups.cpp detail/hemispheres_more.cpp
  detail/hemispheres_views.cpp detail/id.cpp detail/normal.cpp match/cage_search.cpp match/closest.cpp
  match/fallback.cpp match/far_rays.cpp match/outermost.cpp match/part_matcher.cpp match/ray.cpp
  match/saved.cpp match/second_look.cpp)
kiln_compile_together(host cold_5
  bake/pipeline.cpp bake/reasons.cpp bake/view_session.cpp io/mesh/mesh_mtl.cpp io/volume/volume_nifti.cpp
  match/axis.cpp match/cage_reach.cpp match/uv.cpp match/uv_points.cpp match/view_plan.cpp match/views.cpp)
# No bake is faster where these are optimised further. Builds that ask for less keep what they ask for.
if(CMAKE_CXX_FLAGS_RELEASE MATCHES "-O[23]")
  foreach(number RANGE 1 5)
    set_source_files_properties(
      ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/kiln.dir/Unity/unity_cold_${number}_cxx.cxx
      PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>)
  endforeach()
endif()
