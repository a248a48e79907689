(** How steep the functions between layers are, by their derivatives. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz.
From Swarmcert Require Import Exponential Activations ErrorFunction Form Network Checker Meaning.
Open Scope R_scope.

(** No slope is larger in absolute value; of what stays as it is, it is 1. *)
Fixpoint steepest (a : activation) : dyadic :=
  match a with
  | Relu | Tanh | Softplus | Elu | Sorted _ => one
  | Sigmoid => (1, -2)%Z
  | Selu => (7917775536320561, -52)%Z
  | Silu => (72089, -16)%Z
  | Gelu => (4625, -12)%Z
  | Keeping _ b => if is_nonnegative (add (steepest b) (neg one)) then steepest b else one
  end.
(** No slope is negative. *)
Definition is_rising (a : activation) : bool := match a with Silu | Gelu => false | _ => true end.
(** Whether it acts number by number, on all numbers of a layer. *)
Definition is_entrywise (a : activation) : bool := match a with Sorted _ | Keeping _ _ => false | _ => true end.
(** The same where some numbers may stay. *)
Definition changes_numbers (a : activation) : bool := is_entrywise (base a).
Definition is_relu (a : activation) : bool := match a with Relu => true | _ => false end.

Lemma slopes_of_derivative (f d : R -> R) a b : (forall x, derivable_pt_lim f x (d x)) ->
  (forall x, a <= d x <= b) -> slopes f a b.
Proof.
  intros D B x y L. split; [apply (at_least_the_derivative f d)|apply (at_most_the_derivative f d)]; auto;
    intros c _; split; auto; apply B.
Qed.
(** A function of two pieces that meet at 0. *)
Lemma slopes_of_pieces (f : R -> R) a b : (forall x y, x <= y -> y <= 0 -> a * (y - x) <= f y - f x <= b * (y - x)) ->
  (forall x y, 0 <= x -> x <= y -> a * (y - x) <= f y - f x <= b * (y - x)) -> slopes f a b.
Proof.
  intros L R x y H. destruct (Rle_dec y 0); [now apply L|]. destruct (Rle_dec 0 x); [now apply R|].
  specialize (L x 0 ltac:(lra) ltac:(lra)). specialize (R 0 y ltac:(lra) ltac:(lra)). lra.
Qed.

Lemma exp_slopes x y : x <= y -> y <= 0 -> 0 <= exp y - exp x <= y - x.
Proof.
  intros L Hy. pose proof (exp_rises x y L). split; [lra|].
  rewrite <- (Rmult_1_l (y - x)). apply (at_most_the_derivative exp exp); auto. intros c Hc.
  split; [apply derivable_pt_lim_exp|]. rewrite <- exp_0. apply exp_rises. lra.
Qed.
Lemma relu_right x : 0 <= x -> relu x = x. Proof. intros. unfold relu. now rewrite Rmax_right. Qed.
Lemma relu_left x : x <= 0 -> relu x = 0. Proof. intros. unfold relu. now rewrite Rmax_left. Qed.
Lemma falling_right x : 0 <= x -> falling x = 0.
Proof. intros. unfold falling. apply Rmin_left. pose proof (exp_above_line x). lra. Qed.
Lemma falling_left x : x <= 0 -> falling x = exp x - 1.
Proof. intros. unfold falling. apply Rmin_right. pose proof (exp_slopes x 0 H ltac:(lra)). rewrite exp_0 in *. lra. Qed.
(** What ReLU, ELU and SELU have in common. *)
Lemma two_pieces_slopes p n b : 0 <= p <= b -> 0 <= n <= b -> slopes (fun x => p * relu x + n * falling x) 0 b.
Proof.
  intros Hp Hn. apply slopes_of_pieces; intros x y H G.
  - rewrite !relu_left, !falling_left by lra. pose proof (exp_slopes x y H G). nra.
  - rewrite !relu_right, !falling_right by lra. nra.
Qed.
Lemma slopes_extensional f g a b : (forall x, f x = g x) -> slopes f a b -> slopes g a b.
Proof. intros E H x y L. rewrite <- !E. auto. Qed.

Lemma relu_slopes : slopes relu 0 1.
Proof.
  apply (slopes_extensional (fun x => 1 * relu x + 0 * falling x)); [intros; ring|]. apply two_pieces_slopes; lra.
Qed.
Lemma elu_slopes : slopes (act Elu) 0 1.
Proof.
  apply (slopes_extensional (fun x => 1 * relu x + 1 * falling x)); [intros; simpl; ring|].
  apply two_pieces_slopes; lra.
Qed.

Lemma cosh_large x : 1 <= cosh x.
Proof. unfold cosh. pose proof (exp_above_line x). pose proof (exp_above_line (- x)). lra. Qed.
Lemma cosh_sinh x : cosh x * cosh x - sinh x * sinh x = 1.
Proof. unfold cosh, sinh. rewrite <- (exp_opp x). field. Qed.
Lemma tanh_slopes : slopes tanh 0 1.
Proof.
  apply (slopes_of_derivative _ (fun x => (cosh x * cosh x - sinh x * sinh x) / Rsqr (cosh x))).
  - intros x. pose proof (cosh_large x).
    apply (derivable_pt_lim_div sinh cosh x); [apply derivable_pt_lim_sinh|apply derivable_pt_lim_cosh|lra].
  - intros x. rewrite cosh_sinh. pose proof (cosh_large x). unfold Rdiv, Rsqr. rewrite Rmult_1_l.
    assert (1 <= cosh x * cosh x) by nra. split; [apply Rlt_le, Rinv_0_lt_compat; lra|].
    rewrite <- Rinv_1. apply Rinv_le_contravar; lra.
Qed.

Lemma divided x y z : 0 < y -> x <= z * y -> x / y <= z.
Proof. intros H G. apply (Rmult_le_reg_r y); auto. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. Qed.
Lemma divided_below x y z : 0 < y -> z * y <= x -> z <= x / y.
Proof. intros H G. apply (Rmult_le_reg_r y); auto. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. Qed.

Lemma one_and_exp x : derivable_pt_lim (fun x => 1 + exp (- x)) x (- exp (- x)).
Proof.
  replace (- exp (- x)) with (0 + exp (- x) * - (1)) by ring.
  apply (derivable_pt_lim_plus (fun _ => 1) (fun x => exp (- x))); [apply derivable_pt_lim_const|].
  apply (derivable_pt_lim_comp Ropp exp); [|apply derivable_pt_lim_exp].
  apply (derivable_pt_lim_opp id), derivable_pt_lim_id.
Qed.
Lemma sigmoid_slopes : slopes sigmoid 0 (1 / 4).
Proof.
  apply (slopes_extensional (fun x => 1 / (1 + exp (- x)))); [intros; unfold sigmoid, Rdiv; ring|].
  apply (slopes_of_derivative _ (fun x => (0 * (1 + exp (- x)) - - exp (- x) * 1) / Rsqr (1 + exp (- x)))).
  - intros x. pose proof (exp_pos (- x)). apply (derivable_pt_lim_div (fun _ => 1) (fun x => 1 + exp (- x))); [|
        apply one_and_exp|lra]. apply derivable_pt_lim_const.
  - intros x. pose proof (exp_pos (- x)). set (e := exp (- x)) in *. unfold Rsqr.
    assert (0 < (1 + e) * (1 + e)) by nra. pose proof (pow2_ge_0 (e - 1)).
    split; [apply divided_below|apply divided]; auto; lra.
Qed.

Lemma exp_softplus x : exp (softplus x) = 1 + exp x.
Proof. unfold softplus. now destruct (logarithm _ _). Qed.
(** For readers: no theorem uses it, because the library's ln rests on excluded middle. *)
Lemma softplus_ln x : softplus x = ln (1 + exp x).
Proof. apply exp_inv. rewrite exp_softplus, exp_ln; [reflexivity|apply one_and_exp_positive]. Qed.
Lemma softplus_slopes : slopes softplus 0 1.
Proof.
  intros x y L. pose proof (exp_rises x y L).
  assert (softplus x <= softplus y) by (apply exp_before; rewrite !exp_softplus; lra).
  assert (softplus y <= softplus x + (y - x)); [|lra]. apply exp_before.
  rewrite exp_plus, !exp_softplus, Rmult_plus_distr_r, Rmult_1_l, <- exp_plus. replace (x + (y - x)) with y by ring.
  pose proof (exp_above_line (y - x)). lra.
Qed.

Lemma real_below m p : real (m, Z.neg p) = IZR m / 2 ^ Pos.to_nat p. Proof. reflexivity. Qed.
Lemma selu_slopes : slopes (act Selu) 0 (real (steepest Selu)).
Proof.
  unfold steepest. rewrite real_below. change (Pos.to_nat 52) with 52%nat.
  apply two_pieces_slopes; unfold selu_scale, selu_alpha; lra.
Qed.

(** SiLU: t / (1 + e^-t). Its derivative is at most c if (c - 1) e^t + c e^-t + 2 c - 1 - t is not negative, which is
  convex in t. *)
Definition silu_slope (x : R) : R := (1 * (1 + exp (- x)) - - exp (- x) * x) / Rsqr (1 + exp (- x)).
Lemma silu_derivative x : derivable_pt_lim (act Silu) x (silu_slope x).
Proof.
  pose proof (exp_pos (- x)).
  apply (derivable_pt_lim_div id (fun x => 1 + exp (- x))); [apply derivable_pt_lim_id|apply one_and_exp|lra].
Qed.
(** ln 11.01 <= 2.3996. *)
Lemma exp_bound : 1101 / 100 <= exp (23996 / 10000).
Proof.
  set (q := 23996 / 640000).
  assert (10381966 / 10000000 <= exp q) as H0 by (pose proof (exp_square q ltac:(unfold q; lra)); unfold q in *; lra).
  apply exp_double with (b := 1077852 / 1000000) in H0; [|lra|lra].
  apply exp_double with (b := 1161764 / 1000000) in H0; [|lra|lra].
  apply exp_double with (b := 1349695 / 1000000) in H0; [|lra|lra].
  apply exp_double with (b := 1821676 / 1000000) in H0; [|lra|lra].
  apply exp_double with (b := 3318503 / 1000000) in H0; [|lra|lra].
  apply exp_double with (b := 11012462 / 1000000) in H0; [|lra|lra].
  replace (2 * _) with (23996 / 10000) in H0 by (unfold q; field). lra.
Qed.
(** With E = 11.01 in place of e^t at the minimum: (c - 1) (E - 1) >= 1. *)
Lemma silu_steepest t : 1 + exp (- t) + t * exp (- t) <= 72089 / 65536 * ((1 + exp (- t)) * (1 + exp (- t))).
Proof.
  destruct (logarithm (1101 / 100) ltac:(lra)) as [l E]. set (u := t - l).
  assert (exp t = 1101 / 100 * exp u) as A by (rewrite <- E, <- exp_plus; f_equal; unfold u; ring).
  pose proof (exp_opp t) as P. pose proof (exp_pos (- t)).
  pose proof (exp_above_line u). pose proof (exp_above_line (- u)).
  assert (exp (- t) = 100 / 1101 * exp (- u)) as B.
  { unfold u. replace (- (t - l)) with (- t + l) by ring. rewrite exp_plus, E. field. }
  assert (l <= 23996 / 10000) as L by (apply exp_before; rewrite E; apply exp_bound). pose proof (exp_pos t).
  (* Divided by e^-t, with the smaller c = 11.01 / 10.01. *)
  assert (exp t + 1 + t <= 1101 / 1001 * (exp t + 2 + exp (- t))) as K.
  { rewrite A, B. replace t with (u + l) at 1 by (unfold u; ring). lra. }
  apply (Rmult_le_compat_l (exp (- t))) in K; [|lra].
  replace (exp (- t) * (exp t + 1 + t)) with (exp t * exp (- t) + exp (- t) + t * exp (- t)) in K by ring.
  replace (exp (- t) * (1101 / 1001 * (exp t + 2 + exp (- t)))) with
    (1101 / 1001 * (exp t * exp (- t) + 2 * exp (- t) + exp (- t) * exp (- t))) in K by ring.
  rewrite P in K. nra.
Qed.
(** The derivative at x and that at - x add up to 1. *)
Lemma silu_least t : (1 - 72089 / 65536) * ((1 + exp (- t)) * (1 + exp (- t))) <= 1 + exp (- t) + t * exp (- t).
Proof.
  pose proof (silu_steepest (- t)) as U. rewrite Ropp_involutive in U. pose proof (exp_opp t) as P.
  pose proof (exp_pos (- t)). set (e := exp (- t)) in *. set (f := exp t) in *.
  apply (Rmult_le_compat_l (e * e)) in U; [|nra].
  replace (e * e * (1 + f + - t * f)) with (e * e + e * (f * e) - t * e * (f * e)) in U by ring.
  replace (e * e * (72089 / 65536 * ((1 + f) * (1 + f)))) with
    (72089 / 65536 * ((e + f * e) * (e + f * e))) in U by ring.
  rewrite P in U. nra.
Qed.
Lemma silu_slope_between x : 1 - 72089 / 65536 <= silu_slope x <= 72089 / 65536.
Proof.
  pose proof (silu_steepest x). pose proof (silu_least x). unfold silu_slope.
  pose proof (exp_pos (- x)). set (e := exp (- x)) in *. unfold Rsqr.
  assert (0 < (1 + e) * (1 + e)) by nra. split; [apply divided_below|apply divided]; auto; nra.
Qed.
Lemma silu_slopes : slopes (act Silu) (1 - 72089 / 65536) (72089 / 65536).
Proof. apply (slopes_of_derivative _ _ _ _ silu_derivative). exact silu_slope_between. Qed.

Lemma real_silu : real (steepest Silu) = 72089 / 65536.
Proof. unfold steepest. rewrite real_below. change (Pos.to_nat 16) with 16%nat. lra. Qed.
Lemma real_gelu : real (steepest Gelu) = 4625 / 4096.
Proof. unfold steepest. rewrite real_below. change (Pos.to_nat 12) with 12%nat. lra. Qed.
Lemma real_one : real one = 1. Proof. unfold one, real. simpl. ring. Qed.
Lemma keeping_steepest n a : 1 <= real (steepest (Keeping n a)) /\ real (steepest a) <= real (steepest (Keeping n a)).
Proof.
  cbn [steepest]. destruct (is_nonnegative (add (steepest a) (neg one))) eqn:E.
  - apply real_nonnegative in E. rewrite real_add, real_neg, real_one in E. lra.
  - assert (is_positive (neg (add (steepest a) (neg one))) = true) as P.
    { unfold is_nonnegative in E. apply Z.leb_gt in E. unfold is_positive. apply Z.ltb_lt. simpl in *. lia. }
    apply real_positive in P. rewrite real_neg, real_add, real_neg, real_one in P. rewrite real_one. lra.
Qed.
Theorem rising_slopes a : is_rising a = true -> 0 < real (steepest a) /\ slopes (act a) 0 (real (steepest a)).
Proof.
  assert (real (1, -2)%Z = 1 / 4) as Q by (rewrite real_below; change (Pos.to_nat 2) with 2%nat; lra).
  assert (0 < real (steepest Selu)) by (apply real_positive; reflexivity).
  destruct a; simpl is_rising; try discriminate; intros _; simpl steepest; rewrite ?real_one, ?Q; split; try lra.
  - exact relu_slopes.
  - exact tanh_slopes.
  - exact sigmoid_slopes.
  - exact softplus_slopes.
  - exact elu_slopes.
  - auto.
  - exact selu_slopes.
  - intros x y L. simpl. lra.
  - pose proof (keeping_steepest n a). cbn [steepest] in H0. lra.
  - intros x y L. pose proof (keeping_steepest n a) as K. cbn [act steepest] in *. nra.
Qed.
Theorem all_slopes a : 0 <= real (steepest a) /\ slopes (act a) (- real (steepest a)) (real (steepest a)).
Proof.
  destruct (is_rising a) eqn:E.
  - destruct (rising_slopes a E) as [P S]. split; [lra|]. intros x y L. specialize (S x y L). nra.
  - destruct a; try discriminate; (split; [apply Rlt_le, real_positive; reflexivity|]); rewrite ?real_silu, ?real_gelu.
    + intros x y L. pose proof (silu_slopes x y L). nra.
    + intros x y L. pose proof (gelu_slopes x y L). nra.
Qed.

(** For the matrix inequality: no slope is outside of these. *)
Definition range_of (a : activation) : rangeD :=
  (if is_rising a then zero else add one (neg (steepest a)), steepest a).
Theorem range_holds a : slopes (act a) (real (fst (range_of a))) (real (snd (range_of a))).
Proof.
  unfold range_of. cbn [fst snd]. destruct (is_rising a) eqn:E; [rewrite real_zero; now apply rising_slopes|].
  rewrite real_add, real_neg, real_one. destruct a; try discriminate; rewrite ?real_silu, ?real_gelu;
    [exact silu_slopes|]. intros x y L. pose proof (gelu_slopes x y L). lra.
Qed.
(** Of what stays as it is, whose slope is 1. *)
Definition kept_range : rangeD := (add one (-1, -24)%Z, one).
Lemma kept_range_has_one : real (fst kept_range) <= 1 <= real (snd kept_range).
Proof.
  unfold kept_range. cbn [fst snd]. rewrite real_add, real_one, real_below. change (Pos.to_nat 24) with 24%nat. lra.
Qed.
Lemma stays_within r x y : real (fst r) <= 1 <= real (snd r) ->
  increment_within (real (fst r), real (snd r)) x y x y.
Proof.
  unfold increment_within. cbn [fst snd]. intros H.
  replace ((x - y - real (fst r) * (x - y)) * (real (snd r) * (x - y) - (x - y)))
    with ((1 - real (fst r)) * (real (snd r) - 1) * ((x - y) * (x - y))) by ring.
  apply Rmult_le_pos; [apply Rmult_le_pos; lra|]. pose proof (Rle_0_sqr (x - y)) as Q. exact Q.
Qed.
(** What functions are divided by, and between which slopes they are then. *)
Definition unit_of (a : activation) : dyadic := if is_rising a then steepest a else one.
Definition divided_range (a : activation) : rangeD := if is_rising a then (zero, one) else range_of a.
Lemma divided_slopes (f : R -> R) b : 0 < b -> slopes f 0 b -> slopes (fun t => / b * f t) 0 1.
Proof.
  intros P S x y L. specialize (S x y L). pose proof (Rinv_0_lt_compat b P) as Q.
  assert (/ b * (b * (y - x)) = y - x) as E by (field; lra). nra.
Qed.
Theorem divided_range_holds a : 0 < real (unit_of a) /\
  slopes (fun t => / real (unit_of a) * act a t) (real (fst (divided_range a))) (real (snd (divided_range a))).
Proof.
  unfold unit_of, divided_range. destruct (is_rising a) eqn:E.
  - destruct (rising_slopes a E) as [P S]. split; auto. cbn [fst snd]. rewrite real_zero, real_one.
    now apply divided_slopes.
  - rewrite real_one. split; [lra|]. apply (slopes_extensional (act a)); [intros; rewrite Rinv_1; ring|].
    apply range_holds.
Qed.
(** So is what stays, which is not divided. *)
Lemma divided_range_has_one a : real (fst (divided_range a)) <= 1 <= real (snd (divided_range a)).
Proof.
  unfold divided_range. destruct (is_rising a) eqn:E; cbn [fst snd].
  - rewrite real_zero, real_one. lra.
  - unfold range_of. rewrite E. cbn [fst snd]. rewrite real_add, real_neg, real_one.
    destruct a; try discriminate; rewrite ?real_silu, ?real_gelu; lra.
Qed.
