// Public structs whose members callers name: each leaves the others at their defaults, without a warning. Compiled by a
// test with these as errors.
#include "kiln/assess.h"
#include "kiln/asset.h"
#include "kiln/attribute.h"
#include "kiln/bake.h"
#include "kiln/clean.h"
#include "kiln/contour.h"
#include "kiln/error.h"
#include "kiln/gradient.h"
#include "kiln/height_field.h"
#include "kiln/image.h"
#include "kiln/job.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "kiln/material.h"
#include "kiln/mesh.h"
#include "kiln/mesh_view.h"
#include "kiln/message.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/session.h"
#include "kiln/simplify.h"
#include "kiln/source.h"
#include "kiln/texture.h"
#include "kiln/texture_sets.h"
#include "kiln/types.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"

namespace {

[[maybe_unused]] const kiln::AssessOptions kAssessOptions = {.directions = {}};
[[maybe_unused]] const kiln::AssetNode kAssetNode = {.name = {}};
[[maybe_unused]] const kiln::Asset kAsset = {.mesh = {}};
[[maybe_unused]] const kiln::AssetMaps kAssetMaps = {.normal = {}};
[[maybe_unused]] const kiln::EncodeMapsOptions kEncodeMapsOptions = {.format = {}};
[[maybe_unused]] const kiln::AssetMaterial kAssetMaterial = {.name = {}};
[[maybe_unused]] const kiln::SaveAssetOptions kSaveAssetOptions = {.nodes = {}};
[[maybe_unused]] const kiln::SaveGlbOptions kSaveGlbOptions = {.alpha_mode = {}};
[[maybe_unused]] const kiln::PaddingOptions kPaddingOptions = {.texels = {}};
[[maybe_unused]] const kiln::AttributeOptions kAttributeOptions = {.unit_vectors = {}};
[[maybe_unused]] const kiln::EncodingOptions kEncodingOptions = {.space = {}};
[[maybe_unused]] const kiln::ReportOptions kReportOptions = {.errors = {}};
[[maybe_unused]] const kiln::BakeOptions kBakeOptions = {.width = {}};
[[maybe_unused]] const kiln::CleanOptions kCleanOptions = {.windings_alone = {}};
[[maybe_unused]] const kiln::ContourOptions kContourOptions = {.iso = {}};
[[maybe_unused]] const kiln::ExtractOptions kExtractOptions = {.contour = {}};
[[maybe_unused]] const kiln::Warning kWarning = {.code = {}};
[[maybe_unused]] const kiln::GradientOptions kGradientOptions = {.size = {}};
[[maybe_unused]] const kiln::HeightFieldOptions kHeightFieldOptions = {.width = {}};
[[maybe_unused]] const kiln::Heights kHeights = {.image = {}};
[[maybe_unused]] const kiln::Image kImage = {.width = {}};
[[maybe_unused]] const kiln::ImageText kImageText = {.keyword = {}};
[[maybe_unused]] const kiln::SaveImageOptions kSaveImageOptions = {.format = {}};
[[maybe_unused]] const kiln::ConvertOptions kConvertOptions = {.coverage = {}};
[[maybe_unused]] const kiln::ImageLayer kImageLayer = {.name = {}};
[[maybe_unused]] const kiln::MakeLow kMakeLow = {.faces = {}};
[[maybe_unused]] const kiln::SetSize kSetSize = {.set = {}};
[[maybe_unused]] const kiln::MeshFrameArguments kMeshFrameArguments = {.up = {}};
[[maybe_unused]] const kiln::Job kJob = {.high = {}};
[[maybe_unused]] const kiln::OcclusionOptions kOcclusionOptions = {.by = {}};
[[maybe_unused]] const kiln::MapVariant kMapVariant = {.name = {}};
[[maybe_unused]] const kiln::IdEntry kIdEntry = {.name = {}};
[[maybe_unused]] const kiln::MapBound kMapBound = {.kind = {}};
[[maybe_unused]] const kiln::ValueRange kValueRange = {.low = {}};
[[maybe_unused]] const kiln::MapRange kMapRange = {.kind = {}};
[[maybe_unused]] const kiln::Match kMatch = {.width = {}};
[[maybe_unused]] const kiln::RayOptions kRayOptions = {.rule = {}};
[[maybe_unused]] const kiln::PartPair kPartPair = {.low = {}};
[[maybe_unused]] const kiln::PartNames kPartNames = {.low = {}};
[[maybe_unused]] const kiln::Parts kParts = {.count = {}};
[[maybe_unused]] const kiln::ViewOptions kViewOptions = {.count = {}};
[[maybe_unused]] const kiln::VisibilityOptions kVisibilityOptions = {.at = {}};
[[maybe_unused]] const kiln::UvOptions kUvOptions = {.warn_overlap = {}};
[[maybe_unused]] const kiln::MatchOptions kMatchOptions = {.method = {}};
[[maybe_unused]] const kiln::MaterialPicture kMaterialPicture = {.file = {}};
[[maybe_unused]] const kiln::Material kMaterial = {.name = {}};
[[maybe_unused]] const kiln::UvSet kUvSet = {.set = {}};
[[maybe_unused]] const kiln::Mesh kMesh = {.name = {}};
[[maybe_unused]] const kiln::LoadMeshOptions kLoadMeshOptions = {.triangulation = {}};
[[maybe_unused]] const kiln::MeshView kMeshView = {.positions = {}};
[[maybe_unused]] const kiln::MessagePiece kMessagePiece = {.text = {}};
[[maybe_unused]] const kiln::FitNormalsOptions kFitNormalsOptions = {.hard_degrees = {}};
[[maybe_unused]] const kiln::ShadingOptions kShadingOptions = {.rule = {}};
[[maybe_unused]] const kiln::PlanOptions kPlanOptions = {.max_error = {}};
[[maybe_unused]] const kiln::LowPolyPlanOptions kLowPolyPlanOptions = {.max_error = {}};
[[maybe_unused]] const kiln::LodOptions kLodOptions = {.plan = {}};
[[maybe_unused]] const kiln::RenderOptions kRenderOptions = {.size = {}};
[[maybe_unused]] const kiln::SessionOptions kSessionOptions = {.bounds = {}};
[[maybe_unused]] const kiln::SimplifyOptions kSimplifyOptions = {.faces = {}};
[[maybe_unused]] const kiln::Bounds kBounds = {.low = {}};
[[maybe_unused]] const kiln::TextureTile kTextureTile = {.set = {}};
[[maybe_unused]] const kiln::Texture kTexture = {.kind = {}};
[[maybe_unused]] const kiln::TextureSet kTextureSet = {.name = {}};
[[maybe_unused]] const kiln::Length kLength = {.value = {}};
[[maybe_unused]] const kiln::UnwrapOptions kUnwrapOptions = {.method = {}};
[[maybe_unused]] const kiln::Volume kVolume = {.name = {}};
[[maybe_unused]] const kiln::RawVolumeLayout kRawVolumeLayout = {.size = {}};

}  // namespace
