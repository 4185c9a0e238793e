-- What control and video path of an HDMI board tell each other, both in the pixel clock.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.tmds_pkg.all;
use work.video_pkg.all;

package hdmi_pkg is

  -- Errors: those of refocus_video, then words that no encoder sends.
  constant WRONG_WORD : natural  := 4;
  constant ERRORS     : positive := 5;

  -- What the panel wants of the video path.

  type video_settings_t is record
    -- As in refocus_video.
    pass_through : std_logic;
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
    -- The test pattern instead of the input.
    show_pattern : std_logic;
    -- Each change of it clears the errors.
    clear_toggle : std_logic;
  end record video_settings_t;

  -- What the video path reports.

  type video_state_t is record
    -- Channels of the receiver that are aligned to words.
    aligned : std_logic_vector(CHANNELS - 1 downto 0);
    -- As in refocus_video.
    following   : std_logic;
    unsupported : std_logic;
    -- Errors since the last clearing.
    errors : std_logic_vector(ERRORS - 1 downto 0);
    -- Size of the picture.
    columns : count_t;
    rows    : count_t;
  end record video_state_t;

end package hdmi_pkg;
