// SPDX-License-Identifier: Apache-2.0
// WORDS words that the netlist of the Tang Nano 20K sends, sampled in tenths behind each edge of the clock lane, into
// output.hex: ten bits of each channel, bit 0 first.
`timescale 1ps / 1ps

module netlist_bench;
  parameter WORDS = 1;
  parameter PERIOD = 39680;

  reg clk_27 = 0;
  reg [29:0] taken;
  integer k, file, number;

  wire out_clk_p, out_clk_n;
  wire [2:0] out_data_p, out_data_n;
  wire [5:0] led_n;

  tangnano20k_top board (
    .clk_27(clk_27), .key_stop(1'b0), .key_step(1'b0),
    .out_clk_p(out_clk_p), .out_clk_n(out_clk_n), .out_data_p(out_data_p), .out_data_n(out_data_n),
    .led_n(led_n)
  );

  always #18519 clk_27 = ~clk_27;

  initial begin
    file = $fopen("output.hex", "w");
    for (number = 0; number < WORDS; number = number + 1) begin
      @(posedge out_clk_p);
      #(PERIOD / 20);
      for (k = 0; k < 10; k = k + 1) begin
        taken[k] = out_data_p[0];
        taken[10 + k] = out_data_p[1];
        taken[20 + k] = out_data_p[2];
        if (k != 9) #(PERIOD / 10);
      end
      $fdisplay(file, "%h", taken);
    end
    $display("LEDs %b", ~led_n);
    $fclose(file);
    $finish(0);
  end
endmodule
