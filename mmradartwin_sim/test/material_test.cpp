#include "mmradartwin_sim/material.h"

#include "mmradartwin_dsp/input_error.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

Material dielectric(double permittivity, double conductivity) {
  Material m;
  m.relative_permittivity = permittivity;
  m.conductivity_s_per_m = conductivity;
  return m;
}

// ITU-R P.2040 at 77 GHz: |Gamma| at normal incidence of the half space, from the published table of constants.
TEST(Fresnel, ReproducesTheHalfSpacesOfP2040) {
  const struct {
    double permittivity, conductivity, gamma;
  } rows[] = {{5.24, 1.381, .3926}, {3.91, .0477, .3283}, {2.73, .503, .246},  {1.99, .494, .1714},
              {6.31, 1.211, .431},  {2.58, .643, .2335},  {7.07, .307, .4535}, {3.66, 1.560, .3155}};
  for (const auto& row : rows) {
    const Fresnel r = fresnel(dielectric(row.permittivity, row.conductivity), 1, 77e9);
    EXPECT_NEAR(std::abs(r.te), row.gamma, 6e-4);
    EXPECT_NEAR(std::abs(r.te + r.tm), 0, 1e-12);  // the same physical field at normal incidence
  }
}

TEST(Fresnel, VanishesForTmAtBrewstersAngle) {
  const double brewster = std::atan(std::sqrt(4.0));
  EXPECT_LT(std::abs(fresnel(dielectric(4, 0), std::cos(brewster), 77e9).tm), 1e-12);
  EXPECT_NEAR(fresnel(dielectric(4, 0), 1, 77e9).te.real(), -1.0 / 3, 1e-12);
}

TEST(Fresnel, LosesEnergyNeverGainsIt) {
  for (double c = 0.01; c <= 1; c += 0.01) {
    const Fresnel r = fresnel(dielectric(5.24, 1.38), c, 77e9);
    EXPECT_LE(std::abs(r.te), 1);
    EXPECT_LE(std::abs(r.tm), 1);
    EXPECT_GE(r.te.imag(), -1e-12) << "a lossy medium turns TE the other way in exp(-jkL)";
  }
}

TEST(Fresnel, IsPerfectOnAConductor) {
  Material m;
  m.model = MaterialModel::kConductor;
  EXPECT_EQ(fresnel(m, 0.3, 77e9).te, std::complex<double>(-1));
  EXPECT_EQ(fresnel(m, 0.3, 77e9).tm, std::complex<double>(1));
}

TEST(ScalarMaterial, IsItsNominalStrengthAtNormalIncidenceAndFallsOffFromThere) {
  Material m;
  m.model = MaterialModel::kScalar;
  m.base_rcs_db = -3;
  m.back_exp = 8;
  m.mix = 0.6;
  EXPECT_NEAR(db(scalarReflection(m, 1)), -3, 1e-12);
  EXPECT_NEAR(scalarReflection(m, 0), 0.4 * std::pow(10, -3.0 / 20), 1e-12);
  EXPECT_NEAR(scalarReflection(m, 0.5) / std::pow(10, -3.0 / 20), 0.4 + 0.6 * std::pow(0.5, 4), 1e-12);
  EXPECT_EQ(backscatterAmplitude(m, 1, 1, 77e9), 0) << "-99 dB is none";
  m.diff_back_db = -13;
  EXPECT_NEAR(db(backscatterAmplitude(m, 1, 1, 77e9)), -13, 1e-12);
  EXPECT_NEAR(backscatterAmplitude(m, 0.5, 1, 77e9) / backscatterAmplitude(m, 1, 1, 77e9), 0.5 * std::pow(0.5, 4),
              1e-12);
}

class MaterialFile : public SceneFiles {
 protected:
  std::string errorFor(const std::string& line) {
    write("m.yaml", "materials:\n  X: " + line + "\n");
    return errorOf([this] { loadMaterials(path("m.yaml")); });
  }
};

TEST_F(MaterialFile, ReadsTheModels) {
  EXPECT_EQ(loadMaterials(path("materials.yaml")).size(), 5u);
  EXPECT_EQ(loadMaterials(path("materials.yaml")).at("RoughMetal").scattering_coefficient, 0.6);
}

TEST_F(MaterialFile, ShipsThePapersSevenTagsTwice) {
  const std::string folder = MMRADARTWIN_CONFIG "/materials/";
  const auto physical = loadMaterials(folder + "physical_77ghz.yaml"),
             scalar = loadMaterials(folder + "paper_scalar.yaml");
  for (const char* tag : {"Metal", "Concrete", "Wood", "TableTop", "Carpet", "Glass", "Plastic"}) {
    EXPECT_EQ(physical.count(tag), 1u) << tag;
    ASSERT_EQ(scalar.count(tag), 1u) << tag;
    EXPECT_EQ(scalar.at(tag).model, MaterialModel::kScalar);
    EXPECT_EQ(scalar.at(tag).color, physical.at(tag).color) << tag;
  }
  EXPECT_NEAR(std::abs(fresnel(physical.at("Concrete"), 1, 77e9).te), .3926, 5e-4);
  EXPECT_NEAR(std::abs(fresnel(physical.at("Glass"), 1, 77e9).te), .431, 5e-4);
  EXPECT_NEAR(db(scalarReflection(scalar.at("Concrete"), 1)), -8, 1e-12);
  EXPECT_TRUE(physical.at("Carpet").extrapolated);
}

TEST_F(MaterialFile, RefusesWhatItDoesNotUnderstand) {
  EXPECT_NE(errorFor("{model: dielectric, relative_permittivity: 0.5}").find("relative_permittivity"),
            std::string::npos);
  EXPECT_NE(errorFor("{model: dielectric}").find("relative_permittivity"), std::string::npos);
  EXPECT_NE(errorFor("{model: conductor, permittivity: 3}").find("permittivity"), std::string::npos);
  EXPECT_NE(errorFor("{model: wood}").find("scalar"), std::string::npos);
  EXPECT_NE(errorFor("{model: conductor, scattering_coefficient: 1.5}").find("1.5"), std::string::npos);
  EXPECT_NE(errorFor("{model: dielectric, relative_permittivity: .nan}").find("relative_permittivity"),
            std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
