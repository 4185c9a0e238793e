// SPDX-License-Identifier: Apache-2.0
// What happens is kept until software clears it, whatever comes together and for ever.
//
// A bit is high from the clock behind its fault or event until the clock behind a clearing write in whose clock nothing
// happens; nothing else sets or clears it. The interrupt follows what is not masked out.

module event_properties (
    input clk,
    input reset,
    input event_in,
    input frame_in,
    input frame_out,
    input [6:0] new_errors,
    input [6:0] clear_errors,
    input [2:0] clear_happened,
    input [2:0] mask
);
  wire [6:0] errors;
  wire [2:0] happened;
  wire interrupt;

  event_registers dut (
      .clk(clk),
      .reset(reset),
      .events(event_in),
      .frame_in(frame_in),
      .frame_out(frame_out),
      .new_errors(new_errors),
      .clear_errors(clear_errors),
      .clear_happened(clear_happened),
      .mask(mask),
      .errors(errors),
      .happened(happened),
      .interrupt(interrupt)
  );

  // The clock before: what happened, what software cleared, what was kept and let through.
  reg begun = 0, after_reset = 1;
  reg [6:0] errors_new, errors_cleared, errors_kept;
  reg [2:0] happened_new, happened_cleared, happened_kept, let_through;

  always @(posedge clk) begin
    begun <= 1;
    after_reset <= reset;
    errors_new <= new_errors;
    errors_cleared <= clear_errors;
    errors_kept <= errors;
    happened_new <= {new_errors != 0, frame_out, frame_in};
    happened_cleared <= clear_happened;
    happened_kept <= happened;
    let_through <= mask;
  end

  integer i;

  always @* begin
    // The first clock is one of reset.
    assume (begun || reset);
    if (begun) begin
      for (i = 0; i < 7; i = i + 1) begin
        if (after_reset) assert (!errors[i]);
        else if (errors_new[i]) assert (errors[i]);
        else if (errors_cleared[i]) assert (!errors[i]);
        else assert (errors[i] == errors_kept[i]);
      end
      for (i = 0; i < 3; i = i + 1) begin
        if (after_reset) assert (!happened[i]);
        else if (happened_new[i]) assert (happened[i]);
        else if (happened_cleared[i]) assert (!happened[i]);
        else assert (happened[i] == happened_kept[i]);
      end
      assert (interrupt == (!after_reset && (happened_kept & let_through) != 0));
    end
  end
endmodule
