-- SPDX-License-Identifier: Apache-2.0
-- The stream shell around the engine of a core: a raster scan in, the refocused one out, or all slices of a stack.
--
-- What users instantiate (raster_refocuser, focal_stack) makes the core from its generics and instantiates this entity.
-- Engines, sharpener and weights are components, so that a project needs the files of the parts that it builds alone.
--
-- Latency: column_lines lines, row_tokens tokens, and the clocks of the plan and of stream_shell. Throughput: one
-- token each clock.
-- Equation: that of raster_refocuser; with a stack for each slice.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.all;
use work.math_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;

entity refocuser is
  generic (
    CORE : core_t;
    -- Lines that the input FIFO holds.
    INPUT_LINES : positive := 1;
    -- true: the core pushes the rest of a frame out when nothing follows; false: the next frame does.
    FLUSH : boolean := true;
    -- true: each frame has a chosen slice; false: frames have no slice.
    CHOOSES : boolean := true
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size and slice of the next frame.
    order : in    frame_order_t;
    -- The stream of pixels in.
    s_axis_marks  : in    marks_t;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
    -- The stream of pixels out; tid: the slice of the frame that comes out.
    m_axis_marks  : out   marks_t;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(result_bits(CORE) - 1 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    -- Faults of the stream, as in stream_shell.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity refocuser;

architecture rtl of refocuser is

  component border_weights is
    generic (
      CORE : core_t
    );
    port (
      clk          : in    std_logic;
      reset        : in    std_logic;
      token        : in    token_t;
      token_data   : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
      line_end     : in    std_logic_vector(CORE.pixels - 1 downto 0);
      engine_token : out   token_t;
      engine_data  : out   std_logic_vector(row_bits(CORE) - 1 downto 0);
      weights      : out   std_logic_vector(weights_bits(CORE) - 1 downto 0)
    );
  end component border_weights;

  component fir_array is
    generic (
      CORE : core_t
    );
    port (
      clk        : in    std_logic;
      reset      : in    std_logic;
      token      : in    token_t;
      token_rows : in    std_logic_vector(CORE.rows - 1 downto 0);
      token_data : in    std_logic_vector(CORE.rows * row_bits(CORE) - 1 downto 0);
      out_token  : out   tokens_t(0 to CORE.rows - 1);
      out_sums   : out   std_logic_vector(CORE.rows * row_sums_bits(CORE) - 1 downto 0)
    );
  end component fir_array;

  component moving_sum_array is
    generic (
      CORE : core_t
    );
    port (
      clk        : in    std_logic;
      reset      : in    std_logic;
      token      : in    token_t;
      token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
      line_end   : in    std_logic_vector(CORE.pixels - 1 downto 0);
      out_token  : out   tokens_t(0 to 0);
      out_sums   : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
    );
  end component moving_sum_array;

  component stack_array is
    generic (
      CORE : core_t
    );
    port (
      clk        : in    std_logic;
      reset      : in    std_logic;
      token      : in    token_t;
      token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
      line_end   : in    std_logic_vector(CORE.pixels - 1 downto 0);
      out_token  : out   tokens_t(0 to 0);
      out_sums   : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
    );
  end component stack_array;

  -- Tokens of the shell and of the engine, which of their rows are image lines, their pixels; pixels of a line's end.
  signal token        : token_t;
  signal token_rows   : std_logic_vector(CORE.rows - 1 downto 0);
  signal token_data   : std_logic_vector(CORE.rows * row_bits(CORE) - 1 downto 0);
  signal line_end     : std_logic_vector(CORE.pixels - 1 downto 0);
  signal engine_token : token_t;
  signal engine_rows  : std_logic_vector(CORE.rows - 1 downto 0);
  signal engine_data  : std_logic_vector(CORE.rows * row_bits(CORE) - 1 downto 0);

  -- Sums of the engine and their weights; results.
  signal sum_tokens  : tokens_t(0 to CORE.rows - 1);
  signal sums        : std_logic_vector(CORE.rows * row_sums_bits(CORE) - 1 downto 0);
  signal weights     : std_logic_vector(weights_bits(CORE) - 1 downto 0);
  signal results     : results_t(0 to CORE.rows - 1);
  signal result_data : std_logic_vector(CORE.rows * result_bits(CORE) - 1 downto 0);

begin

  shell : entity work.stream_shell
    generic map (
      MAX_COLUMNS      => CORE.columns,
      PIXELS_PER_CLOCK => CORE.pixels,
      PARALLEL_ROWS    => CORE.rows,
      IN_BITS          => row_bits(CORE),
      OUT_BITS         => result_bits(CORE),
      SLICES           => choose(CHOOSES, slices_of(CORE), 0),
      -- Room for the pixels that arrive during a flush line, and 3 words for the FIFO's own latency.
      INPUT_PIXELS   => INPUT_LINES * tokens_of(CORE) + 2 * CORE.rows - 1,
      ROW_DELAY      => CORE.plan.row_tokens,
      COLUMN_DELAY   => choose(FLUSH, CORE.plan.column_lines, 0),
      ENGINE_LATENCY => CORE.plan.clocks,
      MIN_STEPS      => CORE.plan.min_steps,
      MIN_BANDS      => CORE.plan.min_bands,
      BAND_MODULUS   => CORE.plan.modulus,
      KEEP_MODULUS   => CORE.plan.keeps_modulus
    )
    port map (
      clk           => clk,
      reset         => reset,
      order         => order,
      s_axis_marks  => s_axis_marks,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      m_axis_marks  => m_axis_marks,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tid    => m_axis_tid,
      error_flags   => error_flags,
      error_clear   => error_clear,
      token         => token,
      token_rows    => token_rows,
      token_data    => token_data,
      line_end      => line_end,
      results       => results,
      result_data   => result_data
    );

  -- Without weights the tokens go directly to the engine, without an additional LUT.
  zero_border : if not CORE.normalised generate
    engine_token <= token;
    engine_rows  <= token_rows;
    engine_data  <= token_data;
    weights      <= (others => '0');
  end generate zero_border;

  -- The weights stand beside the engine, because all engines are divided by the same weights.
  normalised_border : if CORE.normalised generate

    border : component border_weights
      generic map (
        CORE => CORE
      )
      port map (
        clk          => clk,
        reset        => reset,
        token        => token,
        token_data   => token_data,
        line_end     => line_end,
        engine_token => engine_token,
        engine_data  => engine_data,
        weights      => weights
      );

    engine_rows(0) <= engine_token.image;

  end generate normalised_border;

  -- Only the chosen engine is built.
  fir_engine : if CORE.engine = fir generate

    filters : component fir_array
      generic map (
        CORE => CORE
      )
      port map (
        clk        => clk,
        reset      => reset,
        token      => engine_token,
        token_rows => engine_rows,
        token_data => engine_data,
        out_token  => sum_tokens,
        out_sums   => sums
      );

  end generate fir_engine;

  moving_sum_engine : if CORE.engine = moving_sum generate

    moving_sums : component moving_sum_array
      generic map (
        CORE => CORE
      )
      port map (
        clk        => clk,
        reset      => reset,
        token      => engine_token,
        token_data => engine_data,
        line_end   => line_end,
        out_token  => sum_tokens,
        out_sums   => sums
      );

  end generate moving_sum_engine;

  stack_engine : if CORE.engine = stack generate

    slices : component stack_array
      generic map (
        CORE => CORE
      )
      port map (
        clk        => clk,
        reset      => reset,
        token      => engine_token,
        token_data => engine_data,
        line_end   => line_end,
        out_token  => sum_tokens,
        out_sums   => sums
      );

  end generate stack_engine;

  tail : entity work.sum_tail
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      tokens      => sum_tokens,
      sums        => sums,
      line_end    => line_end,
      weights     => weights,
      results     => results,
      result_data => result_data
    );

end architecture rtl;
