(* What a certificate of this schema states, in words; any other text is refused. *)

let schema = "swarmcert/certificate/2"
(* Of certificates that do not carry the network. *)
let old_schema = "swarmcert/certificate/1"

let common =
  "The functions are the operations listed under chain, in that order, with the weights and biases listed under \
   layers, which were read from the files named by sha256 and rounded to float32 where `as` says so: linear is \
   W x + b; of each number t, relu is the positive \
   part, tanh and sigmoid, 1 / (1 + e^-t), are the functions of these names, softplus is ln(1 + e^t), elu is \
   max(0, t) + min(0, e^t - 1), selu is 1.0507009873554805 max(0, t) + 1.0507009873554805 * 1.6732632423543772 \
   min(0, e^t - 1), silu is t / (1 + e^-t), gelu is t/2 (1 + erf(t / sqrt 2)); clamp is the input clamp listed. \
   Where samples are named, they were reproduced up to largest_deviation when \
   this was written; checking does not repeat that. Every bound holds in exact arithmetic: |f(x) - f(y)| <= upper \
   |x - y| for all x and y that differ in the block only, and |f(x) - f(y)| >= lower |x - y| at the witness; \
   where the domain is box, for x and y in the box. So |df| <= the sum of upper |dx_block| over blocks that make \
   up the input. With a scale, |x - y|^2 is the sum of ((x_k - y_k) / scale_k)^2. In a set function one neighbour \
   moves from x to y, whatever the number and the places of the others; where neighbours are listed, with at most \
   so many of each kind, the moving one included, all in the box, and the ground's input where there is one. Laws \
   hold for the neighbours listed and the ground's input where there is one, in the box where their domain is \
   box: all_stacked, |df| <= upper sqrt(sum |dx_j|^2); all_max, |df| <= upper max |dx_j|; own_state, |df| <= \
   upper |dx| where the vehicle's own state moves by dx. \
   Values hold for inputs in the box, or in the input clamp where their domain is clamp, with up to as many \
   neighbours of the kind as listed and the ground's input where there is one: lower <= f <= upper, and \
   |df| <= jump where one more neighbour comes or goes, whatever the others are, in exact arithmetic; and \
   |g - f| <= float32_error for each g that float32 arithmetic may give, whose inputs after the clamp are \
   off by at most input_error: sums of products in any order, fused or not, each operation rounded to \
   nearest; at most float32_error_in_order where those of each layer start with the bias and add the products \
   from the first input to the last, each rounded or fused."

(* What is added for networks with a layer that is sorted. *)
let sorting =
  " Of the numbers t_1, t_2, ... of a layer, groupsort:k sorts each k side by side, the smallest first; \
   maxmin:halves, of 2 h numbers, is max(t_i, t_(i+h)) for i = 1 .. h and then min(t_i, t_(i+h)); \
   maxmin:pairs is max(t_(2i-1), t_(2i)) for i = 1 .. h and then min(t_(2i-1), t_(2i))."

(* What is added for networks with a skip connection past another activation than ReLU. *)
let keeping =
  " tanh:n, and so with other names, is that function of each of the first n numbers of a layer and leaves the others \
   as they are."

(* What is added for networks that are silent in some compositions, before their names. *)
let silent =
  " Among these neighbours > vehicle, as many of each kind and no others, the set functions of that kind \
   of vehicle are 0. Bounds and laws hold while the neighbours stay the same, lower bounds at witnesses \
   among other neighbours than these. Ranges hold this 0, and jumps bound the steps as well by which one \
   neighbour that comes or goes makes or ends such a composition, while all are in the box or clamp: "

let text ~sorts ~keeps ~silent_names =
  common ^ (if sorts then sorting else "") ^ (if keeps then keeping else "")
  ^ if silent_names = [] then "" else silent ^ String.concat ", " silent_names ^ "."
