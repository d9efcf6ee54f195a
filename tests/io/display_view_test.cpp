// View transforms of an OpenColorIO configuration that the test writes.

#include "polestar/io/display_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "polestar/core/error.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

constexpr const char* kConfig = R"(ocio_profile_version: 1
roles:
  scene_linear: linear
  default: linear
displays:
  screen:
    - !<View> {name: squared, colorspace: squared}
    - !<View> {name: plain, colorspace: linear}
  projector:
    - !<View> {name: halved, colorspace: halved}
active_displays: [screen, projector]
active_views: [squared, plain, halved]
colorspaces:
  - !<ColorSpace>
    name: linear
  - !<ColorSpace>
    name: squared
    from_reference: !<ExponentTransform> {value: [2, 2, 2, 1]}
  - !<ColorSpace>
    name: halved
    from_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
)";

/// Sets $OCIO, and puts back what it was.
class Ocio {
 public:
  explicit Ocio(const std::string& path) {
    if (const char* old = std::getenv("OCIO")) before_ = old;
    setenv("OCIO", path.c_str(), 1);
  }
  ~Ocio() { before_ ? setenv("OCIO", before_->c_str(), 1) : unsetenv("OCIO"); }

 private:
  std::optional<std::string> before_;
};

class DisplayViewTest : public ::testing::Test {
 protected:
  DisplayViewTest() { std::ofstream(folder_ / "config.ocio") << kConfig; }
  static Picture pixel(float value, float alpha) {
    Picture picture(1, 1);
    picture.rgba = {value * alpha, value * alpha, value * alpha, alpha};
    return picture;
  }
  test::ScratchFolder folder_;
};

TEST_F(DisplayViewTest, AppliesTheNamedView) {
  const Ocio environment((folder_ / "config.ocio").string());
  EXPECT_TRUE(DisplayView::configured());
  EXPECT_EQ(DisplayView().name(), "screen / squared");
  EXPECT_NEAR(DisplayView().apply(pixel(0.5f, 1))[0], 0.25f, 1e-5f);
  EXPECT_NEAR(DisplayView("screen", "plain").apply(pixel(0.5f, 1))[1], 0.5f, 1e-5f);
  EXPECT_NEAR(DisplayView("projector").apply(pixel(0.5f, 1))[2], 0.25f, 1e-5f);
}

TEST_F(DisplayViewTest, SeesStraightColors) {
  const Ocio environment((folder_ / "config.ocio").string());
  const std::vector<float> values = DisplayView().apply(pixel(0.5f, 0.25f));
  EXPECT_NEAR(values[0], 0.25f, 1e-5f);
  EXPECT_EQ(values[3], 0.25f);
}

TEST_F(DisplayViewTest, SaysWhatTheConfigurationHas) {
  const Ocio environment((folder_ / "config.ocio").string());
  try {
    DisplayView("cinema");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    EXPECT_THAT(error.what(), HasSubstr("screen, projector"));
  }
  try {
    DisplayView("screen", "halved");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    EXPECT_THAT(error.what(), HasSubstr("squared, plain"));
  }
}

TEST_F(DisplayViewTest, BrokenConfigurationsAreErrors) {
  {
    const Ocio environment("");
    EXPECT_FALSE(DisplayView::configured());
    EXPECT_THROW(DisplayView(), Error);
  }
  const Ocio environment((folder_ / "missing.ocio").string());
  try {
    DisplayView();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), HasSubstr("missing.ocio"));
  }
}

}  // namespace
}  // namespace polestar
