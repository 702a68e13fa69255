// Meshes whose axes, unit or origin are others than the map's. Each file holds the same metal sheet, 1.0 x 0.8 m, 3 m
// in front of the radar at (0, 0, 1), which returns one specular path of 6 m and -86.47 dB.

#include "mmradartwin_sim/mesh_frame.h"

#include <gtest/gtest.h>

#include <functional>
#include <regex>

#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;
using Turn = std::function<V(const V&)>;  ///< map, metres -> file

const std::vector<V> kSheet = {{3, -0.5, 0.6}, {3, 0.5, 0.6}, {3, 0.5, 1.4}, {3, -0.5, 1.4}};

V unturned(const V& p) { return p; }
V yUp(const V& p) { return {p.x(), p.z(), -p.y()}; }
V xUp(const V& p) { return {p.z(), -p.x(), -p.y()}; }

std::string numbers(const Turn& turn, double units_per_m, const char* between, const V& origin = V::Zero()) {
  std::ostringstream text;
  text.precision(15);
  for (const V& corner : kSheet) {
    const V p = units_per_m * turn(corner + origin);
    text << (text.tellp() > 0 ? between : "") << p.x() << between << p.y() << between << p.z();
  }
  return text.str();
}

std::string obj(const Turn& turn, double units_per_m, const V& origin = V::Zero()) {
  std::ostringstream text;
  text.precision(15);
  text << "mtllib none.mtl\no sheet\nusemtl Metal\n";
  for (const V& corner : kSheet) text << "v " << (units_per_m * turn(corner + origin)).transpose() << "\n";
  text << "f 1 2 3 4\n";
  return text.str();
}

std::string collada(const std::string& asset, const Turn& turn, double units_per_m) {
  return R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>)" +
         asset + R"(</asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="common"><lambert/></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m" name="Metal"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g" name="sheet"><mesh><source id="p"><float_array id="a" count="12">)" +
         numbers(turn, units_per_m, " ") +
         R"(</float_array><technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="s" count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="V"><node id="sheet" name="sheet" type="NODE"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="s" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#V"/></scene></COLLADA>)";
}

std::string fbx(const std::string& settings, const Turn& turn, double units_per_m) {
  return R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
)" + settings +
         R"(	}
}
Objects:  {
	Geometry: 1001, "Geometry::sheet", "Mesh" {
		Vertices: *12 {
			a: )" +
         numbers(turn, units_per_m, ",") + R"(
		}
		PolygonVertexIndex: *4 {
			a: 0,1,2,-4
		}
		LayerElementMaterial: 0 {
			MappingInformationType: "AllSame"
			ReferenceInformationType: "IndexToDirect"
			Materials: *1 {
				a: 0
			}
		}
		Layer: 0 {
			LayerElement:  {
				Type: "LayerElementMaterial"
				TypedIndex: 0
			}
		}
	}
	Model: 2001, "Model::sheet", "Mesh" {
		Version: 232
	}
	Material: 3001, "Material::Metal", "" {
		Version: 102
	}
}
Connections:  {
	C: "OO",2001,0
	C: "OO",1001,2001
	C: "OO",3001,2001
}
)";
}

std::string setting(const std::string& key, int value) {
  return "\t\tP: \"" + key + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) + "\n";
}
std::string axes(int up, int up_sign, int front, int front_sign, int coord, int coord_sign) {
  return setting("UpAxis", up) + setting("UpAxisSign", up_sign) + setting("FrontAxis", front) +
         setting("FrontAxisSign", front_sign) + setting("CoordAxis", coord) + setting("CoordAxisSign", coord_sign);
}
std::string unit(double centimetres) {
  return "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," + std::to_string(centimetres) + "\n";
}

class MeshFrameTest : public SceneFiles {
 protected:
  std::string scene(const std::string& mesh, const std::string& content, const std::string& more = "") const {
    write(mesh, content);
    write("scene.yaml", "meshes:\n  - {file: " + mesh + more + "}\nmaterials: materials.yaml\n" +
                            "actors: {sheet: {material: Metal}}\n");
    return path("scene.yaml");
  }
  void expectSheet(const std::string& mesh, const std::string& content, const std::string& more = "") const {
    SCOPED_TRACE(mesh + more);
    const Twin twin = makeTwin(scene(mesh, content, more));
    const std::vector<PathRecord> paths = twin.simulate(radarPose(0, 0, 1)).records;
    ASSERT_EQ(paths.size(), 1u);
    EXPECT_NEAR(paths[0].length_m[0], 6, 2e-6);
    EXPECT_NEAR(db(paths[0].amplitude), -86.47, 0.005);
  }
  std::string refusal(const std::string& mesh, const std::string& content, const std::string& more = "") const {
    return errorOf([&] { loadScene(scene(mesh, content, more), 77e9); });
  }
};

TEST_F(MeshFrameTest, HonoursWhatColladaDeclares) {
  const std::string centimetres = R"(<unit name="centimeter" meter="0.01"/>)";
  expectSheet("sheet.dae", collada("<up_axis>Z_UP</up_axis>", unturned, 1));
  expectSheet("sheet.dae", collada(centimetres + "<up_axis>Z_UP</up_axis>", unturned, 100));
  expectSheet("sheet.dae", collada(centimetres + "<up_axis>Y_UP</up_axis>", yUp, 100));
  expectSheet("sheet.dae", collada("<up_axis>X_UP</up_axis>", xUp, 1));
  expectSheet("sheet.dae", collada("", yUp, 1));  // the default of the format
}

TEST_F(MeshFrameTest, HonoursWhatFbxDeclares) {
  expectSheet("sheet.fbx", fbx(axes(1, 1, 2, 1, 0, 1) + unit(1), yUp, 100));
  expectSheet("sheet.fbx", fbx(axes(2, 1, 1, -1, 0, 1) + unit(1), unturned, 100));
  expectSheet("sheet.fbx", fbx(axes(2, 1, 1, -1, 0, 1) + unit(100), unturned, 1));
  expectSheet("sheet.fbx", fbx(axes(1, 1, 2, 1, 0, 1) + unit(2.54), yUp, 1 / 0.0254));
  expectSheet("sheet.fbx", fbx("", yUp, 100));  // the defaults of the format
  // Front along x, right along y.
  expectSheet("sheet.fbx",
              fbx(
                  axes(2, 1, 0, 1, 1, 1) + unit(1), [](const V& p) { return V(-p.y(), p.x(), p.z()); }, 100));
  // Up alone, or with other axes that are left-handed.
  expectSheet("sheet.fbx", fbx(setting("UpAxis", 2) + unit(1), unturned, 100));
  expectSheet("sheet.fbx", fbx(axes(1, 1, 2, -1, 0, 1) + unit(1), yUp, 100));
}

TEST_F(MeshFrameTest, TakesUnitAndAxesFromTheSceneWhereTheFileDeclaresNone) {
  expectSheet("sheet.obj", obj(unturned, 1000), ", unit: mm");
  expectSheet("sheet.obj", obj(unturned, 100), ", unit: cm");
  expectSheet("sheet.obj", obj(unturned, 1 / 0.0254), ", unit: in");
  expectSheet("sheet.obj", obj(yUp, 1), ", up: y");
  expectSheet("sheet.obj", obj(yUp, 1000), ", up: y, unit: mm");
  const std::string stl =
      "solid x\nfacet normal 1 0 0\nouter loop\nvertex 3000 600 500\nvertex 3000 600 -500\nvertex 3000 1400 -500\n"
      "endloop\nendfacet\nfacet normal 1 0 0\nouter loop\nvertex 3000 600 500\nvertex 3000 1400 -500\n"
      "vertex 3000 1400 500\nendloop\nendfacet\nendsolid x\n";
  expectSheet("sheet.stl", stl, ", up: y, unit: mm");
}

TEST_F(MeshFrameTest, PlacesWhatItHasTurnedAsBefore) {
  // p_map = R (scale p) + xyz, p in metres with z up.
  const V shift(1, 2, 3);
  const Scene placed =
      loadScene(scene("sheet.obj", obj(yUp, 1000), ", up: y, unit: mm, scale: 2, xyz_m: [1, 2, 3]"), 77e9);
  EXPECT_LT((placed.actors[0].vertices[0] - (2 * kSheet[0] + shift)).norm(), 1e-9);
}

TEST_F(MeshFrameTest, RefusesToStateWhatTheFileDeclares) {
  const std::string file = collada("<up_axis>Z_UP</up_axis>", unturned, 1);
  const std::string up = refusal("sheet.dae", file, ", up: y"), length = refusal("sheet.dae", file, ", unit: mm");
  EXPECT_NE(up.find("sheet.dae: declares its axes itself"), std::string::npos) << up;
  EXPECT_NE(length.find("sheet.dae: declares its unit itself"), std::string::npos) << length;
  EXPECT_NE(refusal("sheet.obj", obj(unturned, 1), ", unit: yd").find("unit"), std::string::npos);
  EXPECT_NE(refusal("sheet.obj", obj(unturned, 1), ", up: x").find("up"), std::string::npos);
}

TEST_F(MeshFrameTest, TakesAFarOriginOffBeforeDigitsAreLost) {
  const V utm(451200.25, 5411000.5, 420.125);
  const std::string off = ", origin: [451200.25, 5411000.5, 420.125]";
  expectSheet("sheet.obj", obj(unturned, 1, utm), off);
  expectSheet("sheet.obj", obj(yUp, 1, utm), ", up: y" + off);
  expectSheet("sheet.obj", obj(unturned, 1000, utm), ", unit: mm" + off);
  std::ostringstream ply;
  ply.precision(15);
  ply << "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const V& corner : kSheet) ply << (corner + utm).transpose() << "\n";
  ply << "4 0 1 2 3\n";
  expectSheet("sheet.ply", ply.str(), off);
}

TEST_F(MeshFrameTest, RefusesAFarOriginAndSaysWhichToTakeOff) {
  // Beyond a thousand kilometres, and nearer where single precision blurs it all the same.
  for (const V& far : {V(451200, 5411000, 0), V(451200, 311000, 0)}) {
    const std::string error = refusal("sheet.obj", obj(unturned, 1, far));
    std::smatch origin;
    ASSERT_TRUE(std::regex_search(error, origin, std::regex("origin: \\[[^\\]]*\\]"))) << error;
    EXPECT_NE(error.find("sheet.obj"), std::string::npos);
    const Scene near = loadScene(scene("sheet.obj", obj(unturned, 1, far), ", " + origin.str()), 77e9);
    EXPECT_LT((near.actors[0].vertices[2] - near.actors[0].vertices[0] - (kSheet[2] - kSheet[0])).norm(), 1e-9);
    EXPECT_LT(near.actors[0].bounds.max().cwiseAbs().maxCoeff(), 201);
  }
}

TEST_F(MeshFrameTest, LeavesLargeNumbersOfSmallUnitsAlone) {
  expectSheet("sheet.obj", obj(unturned, 100000), ", scale: 1.0e-5");  // 3 m are 300000
}

}  // namespace
}  // namespace mmradartwin
