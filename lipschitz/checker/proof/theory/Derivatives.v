(** Slopes of activations between two numbers, from below and above, as multiples of 2^-24. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations ErrorFunction Algebra Form Network Checker Fixed Normal Meaning
    Steepness Sets Lower Values Enclosures Intervals.
Import ListNotations.
Open Scope Z_scope.

(** e / (1 + e)^2. *)
Definition bumpF (e : fixed) : fixed := divF e (mulF (addF oneF e) (addF oneF e)).
Definition is_below_zero (x : dyadic) : bool := negb (is_nonnegative x).
(** The derivative; at 0 that of ELU and SELU from the left. *)
Definition slope_at (a : activation) (t : dyadic) : fixed :=
  match a with
  | Tanh => mulF (4 * unit_of_fixed, 4 * unit_of_fixed) (bumpF (exp_of_minus_size (shift 1 t)))
  | Sigmoid => bumpF (exp_of_minus_size t)
  | Softplus => sigmoidF t
  | Elu => if is_positive t then oneF else exp_of_minus_size t
  | Selu => if is_positive t then selu_scaleF else mulF (mulF selu_scaleF selu_alphaF) (exp_of_minus_size t)
  | Silu => addF (sigmoidF t) (mulF (of_dyadic t) (bumpF (exp_of_minus_size t)))
  | Gelu => gelu_slopeF t
  | Relu | Sorted _ | Keeping _ _ => (0, 0)
  end.
(** The absolute values of an interval's numbers. *)
Definition nearest (i : dyadic * dyadic) : dyadic :=
  if is_below_zero (fst i) && is_positive (snd i) then zero else smaller (abs (fst i)) (abs (snd i)).
Definition farthest (i : dyadic * dyadic) : dyadic := larger (abs (fst i)) (abs (snd i)).
(** The derivatives of SiLU and GELU are largest between these two numbers, and least between their negatives. *)
Definition steepest_place (a : activation) : dyadic * dyadic :=
  match a with Gelu => ((362, -8), (5793, -12)) | _ => ((4913, -11), (4914, -11)) end.
Definition derivatives (a : activation) (i : dyadic * dyadic) : dyadic * dyadic :=
  let negative := is_below_zero (fst i) in
  let positive := is_positive (snd i) in
  match a with
  | Relu => (if negative || negb positive then zero else one, if positive then one else zero)
  | Tanh | Sigmoid => ((fst (slope_at a (farthest i)), -256), (snd (slope_at a (nearest i)), -256))
  | Selu =>
      let scale := selu_scaleF in
      if negative then
        let least := (fst (slope_at Selu (fst i)), -256) in
        (if positive then smaller least (fst scale, -256) else least,
         (snd (slope_at Selu (if positive then zero else snd i)), -256))
      else ((fst scale, -256), (snd scale, -256))
  | Silu | Gelu =>
      let s := slope_at a (fst i) in
      let t := slope_at a (snd i) in
      let (p, q) := steepest_place a in
      (if below (neg p) (fst i) || below (snd i) (neg q)
       then smaller (fst s, -256) (fst t, -256) else fst (range_of a),
       if below q (fst i) || below (snd i) p
       then larger (snd s, -256) (snd t, -256) else steepest a)
  | _ => ((fst (slope_at a (fst i)), -256), (snd (slope_at a (snd i)), -256))
  end.
Definition slopes_between (a : activation) (i : dyadic * dyadic) : dyadic * dyadic :=
  let (l, h) := derivatives a i in
  (larger (add (ceil_to (-24) l) (-1, -24)) (if is_rising a then zero else add one (neg (steepest a))),
   smaller (add (floor_to (-24) h) (1, -24)) (steepest a)).

Open Scope R_scope.
Definition slopes_in (i : dyadic * dyadic) (f : R -> R) (l h : R) : Prop :=
  forall x y, real (fst i) <= x -> x <= y -> y <= real (snd i) -> l * (y - x) <= f y - f x <= h * (y - x).

Lemma not_positive_real x : is_positive x = false -> real x <= 0.
Proof.
  intros H. assert (is_nonnegative (neg x) = true) as N.
  { unfold is_positive, is_nonnegative, neg in *. simpl. apply Z.leb_le. apply Z.ltb_ge in H. lia. }
  apply real_nonnegative in N. rewrite real_neg in N. lra.
Qed.
Lemma derivable_pt_lim_ext (f g : R -> R) x l : (forall z, f z = g z) -> derivable_pt_lim f x l ->
  derivable_pt_lim g x l.
Proof. intros E D e He. destruct (D e He) as [d H]. exists d. intros h H1 H2. rewrite <- !E. now apply H. Qed.

(** Rounding *)
Lemma shift_close a n : (0 <= n)%Z -> IZR a <= (IZR (Z.shiftr a n) + 1) * powerRZ 2 n.
Proof.
  intros H. rewrite Z.shiftr_div_pow2, power_integer by auto. rewrite <- plus_IZR, <- mult_IZR. apply IZR_le.
  pose proof (Z.mul_succ_div_gt a (2 ^ n) ltac:(now apply Z.pow_pos_nonneg)). lia.
Qed.
Lemma floor_to_close u x : real x <= real (floor_to u x) + real (1, u)%Z.
Proof.
  unfold floor_to. assert (0 < real (1, u)%Z) by (apply real_positive; reflexivity).
  destruct (Z.leb_spec u (snd x)) as [L|L]; [lra|]. unfold floor_at.
  destruct (Z.leb_spec 0 (snd x - u)) as [M|M]; [lia|]. unfold real. cbn [fst snd]. set (e := (snd x - u)%Z) in *.
  pose proof (shift_close (fst x) (- e) ltac:(lia)) as S. pose proof (power_pos (snd x)) as P.
  assert (powerRZ 2 (- e) * powerRZ 2 (snd x) = powerRZ 2 u) as E.
  { rewrite <- powerRZ_add by apply two_neq. f_equal. unfold e. lia. }
  apply (Rmult_le_compat_r (powerRZ 2 (snd x))) in S; [|lra]. rewrite Rmult_assoc, E in S. lra.
Qed.
Lemma ceil_to_close u x : real (ceil_to u x) <= real x + real (1, u)%Z.
Proof.
  unfold ceil_to. assert (0 < real (1, u)%Z) by (apply real_positive; reflexivity).
  destruct (Z.leb_spec u (snd x)) as [L|L]; [lra|]. pose proof (floor_to_close u (neg x)) as H'. unfold floor_to in H'.
  change (snd (neg x)) with (snd x) in H'. destruct (Z.leb_spec u (snd x)); [lia|]. unfold ceil_at.
  rewrite real_neg in H'. replace (real (- floor_at u (neg x), u)%Z) with (- real (floor_at u (neg x), u)%Z)
    by (unfold real; simpl; rewrite opp_IZR; ring). lra.
Qed.
Lemma rounded_slopes a i l h : is_entrywise a = true ->
  slopes_in i (act a) (real l) (real h) -> derivatives a i = (l, h) ->
  slopes_in i (act a) (real (fst (slopes_between a i))) (real (snd (slopes_between a i))).
Proof.
  intros E H D x y L1 L L2. unfold slopes_between. rewrite D. cbn [fst snd].
  rewrite real_larger, real_smaller, !real_add.
  pose proof (ceil_to_close (-24) l) as C. pose proof (floor_to_close (-24) h) as F.
  assert (real (-1, -24)%Z = - real (1, -24)%Z) as N by (unfold real; simpl; ring). rewrite N.
  destruct (H x y L1 L L2) as [A B]. pose proof (range_holds a) as S. unfold range_of in S. cbn [fst snd] in S.
  destruct (S x y L) as [S1 S2]. split.
  - unfold Rmax. destruct (Rle_dec _ _); [exact S1|]. nra.
  - unfold Rmin. destruct (Rle_dec _ _); [|exact S2]. nra.
Qed.

(** Of functions that lie above tangents of slope g, which rises. *)
Lemma slopes_of_tangents (f g : R -> R) i : (forall x y, f y + g y * (x - y) <= f x) ->
  (forall x y, x <= y -> g x <= g y) -> slopes_in i f (g (real (fst i))) (g (real (snd i))).
Proof.
  intros T G x y L1 L L2. pose proof (T x y). pose proof (T y x). pose proof (G _ _ L1). pose proof (G _ _ L2). nra.
Qed.
Lemma slopes_wider i f l h l' h' : l' <= l -> h <= h' -> slopes_in i f l h -> slopes_in i f l' h'.
Proof. intros L H S x y A B C. destruct (S x y A B C). nra. Qed.
Lemma sigmoid_exp x : sigmoid x = exp x / (1 + exp x).
Proof.
  unfold sigmoid. pose proof (exp_opp x) as O. pose proof (exp_pos (- x)). pose proof (exp_pos x).
  apply (Rmult_eq_reg_r ((1 + exp x) * (1 + exp (- x)))); [|nra]. field_simplify; [|lra|lra]. lra.
Qed.
Lemma softplus_tangent x y : softplus y + sigmoid y * (x - y) <= softplus x.
Proof.
  apply exp_before. rewrite exp_plus, !exp_softplus. set (s := sigmoid y). set (d := x - y).
  assert (s = exp y / (1 + exp y)) as Es by apply sigmoid_exp. pose proof (exp_pos y) as Y.
  assert (exp x = exp y * exp d) as Ex by (rewrite <- exp_plus; f_equal; unfold d; ring).
  assert (s * (1 + exp y) = exp y) as Sy by (rewrite Es; field; lra).
  assert (0 < s < 1) as S by nra.
  pose proof (exp_above_line (- (s * d))) as A. pose proof (exp_above_line (d - s * d)) as B.
  assert (exp (s * d) * exp (- (s * d)) = 1) as O by apply exp_opp.
  assert (exp (s * d) * exp (d - s * d) = exp d) as Q by (rewrite <- exp_plus; f_equal; ring).
  pose proof (exp_pos (s * d)) as P. set (e := exp (s * d)) in *.
  assert (e * (1 - s * d) <= 1) by nra. assert (e * (1 + d - s * d) <= exp d) by nra.
  assert (e <= (1 - s) + s * exp d) by nra.
  rewrite Ex. nra.
Qed.
Lemma sigmoid_rises x y : x <= y -> sigmoid x <= sigmoid y.
Proof. intros L. pose proof (sigmoid_slopes x y L). lra. Qed.
Definition elu_slope (x : R) : R := if Rlt_dec 0 x then 1 else exp x.
Lemma elu_tangent x y : act Elu y + elu_slope y * (x - y) <= act Elu x.
Proof.
  assert (forall z, z <= act Elu z) as Line.
  { intros z. cbn [act]. destruct (Rle_lt_dec 0 z); [rewrite relu_right, falling_right by lra; lra|].
    rewrite relu_left, falling_left by lra. pose proof (exp_above_line z). lra. }
  unfold elu_slope. destruct (Rlt_dec 0 y) as [P|P].
  - specialize (Line x). cbn [act] in *. rewrite (relu_right y), (falling_right y) by lra. lra.
  - cbn [act]. rewrite (relu_left y), (falling_left y) by lra. destruct (Rle_lt_dec x 0).
    + rewrite relu_left, falling_left by lra. pose proof (exp_above_line (x - y)) as T.
      replace (exp x) with (exp y * exp (x - y)) by (rewrite <- exp_plus; f_equal; ring). pose proof (exp_pos y). nra.
    + rewrite relu_right, falling_right by lra. pose proof (exp_above_line (- y)). pose proof (exp_opp y).
      pose proof (exp_pos y). pose proof (exp_rises y 0 ltac:(lra)) as M. rewrite exp_0 in M. nra.
Qed.
Lemma elu_slope_rises x y : x <= y -> elu_slope x <= elu_slope y.
Proof.
  intros L. unfold elu_slope. destruct (Rlt_dec 0 x), (Rlt_dec 0 y); try lra; [|now apply exp_rises].
  rewrite <- exp_0. apply exp_rises. lra.
Qed.

(** tanh and sigmoid *)
Definition bump (e : R) : R := e / ((1 + e) * (1 + e)).
Lemma bump_rises e f : 0 < e -> e <= f -> f <= 1 -> bump e <= bump f.
Proof.
  intros P L O. unfold bump. apply divided; [nra|].
  apply (Rmult_le_reg_r ((1 + f) * (1 + f))); [nra|].
  replace (f / ((1 + f) * (1 + f)) * ((1 + e) * (1 + e)) * ((1 + f) * (1 + f))) with (f * ((1 + e) * (1 + e)))
    by (field; lra). assert (0 <= (f - e) * (1 - e * f)) by (apply Rmult_le_pos; nra). nra.
Qed.
Lemma bump_inverse e f : e * f = 1 -> 0 < e -> bump f = bump e.
Proof.
  intros H P. assert (0 < f) by nra. unfold bump. apply (Rmult_eq_reg_r ((1 + e) * (1 + e) * ((1 + f) * (1 + f))));
    [|nra].
  replace (f / ((1 + f) * (1 + f)) * ((1 + e) * (1 + e) * ((1 + f) * (1 + f)))) with (f * ((1 + e) * (1 + e)))
    by (field; lra).
  replace (e / ((1 + e) * (1 + e)) * ((1 + e) * (1 + e) * ((1 + f) * (1 + f)))) with (e * ((1 + f) * (1 + f)))
    by (field; lra).
  replace (f * ((1 + e) * (1 + e))) with (f + 2 * (e * f) + e * (e * f)) by ring.
  replace (e * ((1 + f) * (1 + f))) with (e + 2 * (e * f) + f * (e * f)) by ring. rewrite H. ring.
Qed.
(** The bump of e^-|x|, which falls with |x|. *)
Definition sigmoid_slope (x : R) : R := bump (exp (- Rabs x)).
Lemma sigmoid_slope_any x : sigmoid_slope x = bump (exp (- x)).
Proof.
  unfold sigmoid_slope. destruct (Rle_lt_dec 0 x); [now rewrite Rabs_pos_eq|].
  rewrite Rabs_left, Ropp_involutive by auto.
  apply bump_inverse; [rewrite Rmult_comm; apply exp_opp|apply exp_pos].
Qed.
Lemma sigmoid_slope_falls x y : Rabs x <= Rabs y -> sigmoid_slope y <= sigmoid_slope x.
Proof.
  intros L. apply bump_rises; [apply exp_pos|apply exp_rises; lra|]. rewrite <- exp_0. apply exp_rises.
  pose proof (Rabs_pos x). lra.
Qed.
Lemma sigmoid_derivative x : derivable_pt_lim sigmoid x (sigmoid_slope x).
Proof.
  rewrite sigmoid_slope_any. unfold bump. pose proof (exp_pos (- x)).
  replace (exp (- x) / ((1 + exp (- x)) * (1 + exp (- x)))) with
    ((0 * (1 + exp (- x)) - - exp (- x) * 1) / Rsqr (1 + exp (- x))) by (unfold Rsqr; field; lra).
  apply (derivable_pt_lim_ext (fun x => 1 / (1 + exp (- x)))); [intros z; unfold sigmoid, Rdiv; ring|].
  apply (derivable_pt_lim_div (fun _ => 1) (fun x => 1 + exp (- x)));
    [apply derivable_pt_lim_const|apply one_and_exp|lra].
Qed.
Lemma tanh_sigmoid x : tanh x = 2 * sigmoid (2 * x) - 1.
Proof.
  rewrite tanh_right. unfold sigmoid. pose proof (exp_pos (- (2 * x))). field. lra.
Qed.
Lemma tanh_slopes_in_sigmoid i l h : (forall x, real (fst i) <= x <= real (snd i) ->
  l <= 4 * sigmoid_slope (2 * x) <= h) ->
  slopes_in i tanh l h.
Proof.
  intros H x y L1 L L2. rewrite !tanh_sigmoid.
  pose proof (at_least_the_derivative sigmoid sigmoid_slope (l / 4) (2 * x) (2 * y) ltac:(lra)) as A.
  pose proof (at_most_the_derivative sigmoid sigmoid_slope (h / 4) (2 * x) (2 * y) ltac:(lra)) as B.
  assert (forall c, 2 * x <= c <= 2 * y -> l <= 4 * sigmoid_slope c <= h) as K
    by (intros c Hc; replace c with (2 * (c / 2)) by field; apply H; lra).
  assert (l / 4 * (2 * y - 2 * x) <= sigmoid (2 * y) - sigmoid (2 * x)); [apply A|
    assert (sigmoid (2 * y) - sigmoid (2 * x) <= h / 4 * (2 * y - 2 * x)); [apply B|lra]];
    intros c Hc; (split; [apply sigmoid_derivative|]); specialize (K c Hc); lra.
Qed.
Lemma sigmoid_slopes_in i l h : (forall x, real (fst i) <= x <= real (snd i) -> l <= sigmoid_slope x <= h) ->
  slopes_in i sigmoid l h.
Proof.
  intros H x y L1 L L2. split; [apply (at_least_the_derivative sigmoid sigmoid_slope)|
    apply (at_most_the_derivative sigmoid sigmoid_slope)]; auto; intros c Hc; (split; [apply sigmoid_derivative|]);
    apply H; lra.
Qed.
Lemma inside_bump f e : inside f e -> 0 <= e -> inside (bumpF f) (bump e).
Proof.
  intros H P. unfold bumpF, bump. apply inside_div; auto; [|nra]. apply inside_mul; now apply inside_one_and.
Qed.
Lemma inside_sigmoid_slope t : inside (bumpF (exp_of_minus_size t)) (sigmoid_slope (real t)).
Proof. apply inside_bump; [apply inside_exp_size|left; apply exp_pos]. Qed.
Lemma sizes_between i x : lies i x -> Rabs (real (nearest i)) <= Rabs x <= Rabs (real (farthest i)).
Proof.
  intros [L H]. unfold nearest, farthest. rewrite real_larger, !real_abs. split.
  - destruct (is_below_zero (fst i)) eqn:B; cbn [andb].
    + destruct (is_positive (snd i)) eqn:P; [rewrite real_zero, Rabs_R0; apply Rabs_pos|].
      unfold is_below_zero in B. apply negb_true_iff, negative_real in B.
      assert (real (snd i) <= 0) by now apply not_positive_real.
      rewrite real_smaller, !real_abs. rewrite (Rabs_pos_eq (Rmin _ _)) by (apply Rmin_glb; apply Rabs_pos).
      apply Rle_trans with (Rabs (real (snd i))); [apply Rmin_r|]. rewrite !Rabs_left1 by lra. lra.
    + unfold is_below_zero in B. apply negb_false_iff, real_nonnegative in B.
      rewrite real_smaller, !real_abs. rewrite (Rabs_pos_eq (Rmin _ _)) by (apply Rmin_glb; apply Rabs_pos).
      apply Rle_trans with (Rabs (real (fst i))); [apply Rmin_l|]. rewrite !Rabs_pos_eq by lra. lra.
  - eapply Rle_trans; [|apply Rle_abs]. destruct (Rle_lt_dec 0 x).
    + eapply Rle_trans; [|apply Rmax_r]. rewrite !Rabs_pos_eq by lra. lra.
    + eapply Rle_trans; [|apply Rmax_l]. rewrite !Rabs_left1 by lra. lra.
Qed.
Lemma inside_four : inside (4 * unit_of_fixed, 4 * unit_of_fixed)%Z 4.
Proof. unfold inside. cbn [fst snd]. rewrite mult_IZR, U_integer. lra. Qed.

(** SELU *)
Lemma selu_constants_order : 0 < selu_scale /\ selu_scale <= selu_scale * selu_alpha.
Proof. unfold selu_scale, selu_alpha. lra. Qed.
Lemma selu_left x y : x <= y -> y <= 0 -> let k := selu_scale * selu_alpha in
  k * exp x * (y - x) <= act Selu y - act Selu x <= k * exp y * (y - x).
Proof.
  intros L N k. pose proof selu_constants_order. assert (0 < k) by (unfold k; lra). cbn [act]. fold k.
  rewrite !relu_left, !falling_left by lra. pose proof (exp_above_line (y - x)) as A.
  pose proof (exp_above_line (x - y)) as B. pose proof (exp_pos x). pose proof (exp_pos y).
  assert (exp y = exp x * exp (y - x)) as E by (rewrite <- exp_plus; f_equal; ring).
  assert (exp x = exp y * exp (x - y)) as F by (rewrite <- exp_plus; f_equal; ring).
  apply (Rmult_le_compat_l (exp x)) in A; [|lra]. apply (Rmult_le_compat_l (exp y)) in B; [|lra].
  rewrite <- E in A. rewrite <- F in B.
  assert (exp x * (y - x) <= exp y - exp x) as C by lra. assert (exp y - exp x <= exp y * (y - x)) as D by lra.
  apply (Rmult_le_compat_l k) in C, D; lra.
Qed.
Lemma selu_right x y : 0 <= x -> x <= y -> act Selu y - act Selu x = selu_scale * (y - x).
Proof. intros N L. cbn [act]. rewrite !relu_right, !falling_right by lra. ring. Qed.
Lemma selu_slopes_in i : slopes_in i (act Selu) (real (fst (derivatives Selu i))) (real (snd (derivatives Selu i))).
Proof.
  set (k := selu_scale * selu_alpha). pose proof selu_constants_order as O. fold k in O.
  destruct inside_selu_constants as [S A]. pose proof (inside_mul _ _ _ _ S A) as K. fold k in K.
  assert (forall t, real t <= 0 -> is_positive t = false) as N.
  { intros t Ht. destruct (is_positive t) eqn:P; auto. apply real_positive in P. lra. }
  assert (forall t, is_positive t = false -> inside (slope_at Selu t) (k * exp (real t))) as V.
  { intros t P. cbn [slope_at]. rewrite P. apply not_positive_real in P. apply inside_mul; [exact K|].
    pose proof (inside_exp_size t) as X. now rewrite Rabs_left1, Ropp_involutive in X. }
  apply inside_ends in S. intros x y L1 L L2. cbn [derivatives]. generalize dependent (slope_at Selu). intros f V.
  unfold is_below_zero. destruct (is_nonnegative (fst i)) eqn:B; cbn [negb].
  - apply real_nonnegative in B. cbn [fst snd]. rewrite selu_right by lra. nra.
  - apply negative_real in B. pose proof (inside_ends _ _ (V (fst i) (N (fst i) ltac:(lra)))) as Least.
    assert (forall u v, real (fst i) <= u -> u <= v -> v <= 0 ->
      k * exp (real (fst i)) * (v - u) <= act Selu v - act Selu u <= k * exp v * (v - u)) as Left.
    { intros u v Hu Huv Hv. pose proof (selu_left u v Huv Hv) as [D1 D2]. fold k in D1, D2.
      pose proof (exp_rises _ _ Hu). split; [|exact D2]. eapply Rle_trans; [|exact D1].
      apply Rmult_le_compat_r; [lra|]. apply Rmult_le_compat_l; lra. }
    assert (forall v, v <= 0 -> k * exp v <= k) as Most.
    { intros v Hv. pose proof (exp_rises v 0 Hv) as M. rewrite exp_0 in M. rewrite <- (Rmult_1_r k) at 2.
      apply Rmult_le_compat_l; lra. }
    destruct (is_positive (snd i)) eqn:P; cbn [fst snd].
    + pose proof (inside_ends _ _ (V zero eq_refl)) as Z. rewrite real_zero, exp_0, Rmult_1_r in Z.
      rewrite real_smaller. set (a := real (fst (f (fst i)), (-256)%Z)) in *.
      set (b := real (fst selu_scaleF, (-256)%Z)) in *. set (c := real (snd (f zero), (-256)%Z)) in *.
      pose proof (Rmin_l a b). pose proof (Rmin_r a b). set (m := Rmin a b) in *. clearbody m a b c.
      assert (forall u v, real (fst i) <= u -> u <= v -> v <= 0 ->
        m * (v - u) <= act Selu v - act Selu u <= c * (v - u))
        as Left'.
      { intros u v Hu Huv Hv. destruct (Left u v Hu Huv Hv). pose proof (Most v Hv). split; nra. }
      assert (forall u v, 0 <= u -> u <= v -> m * (v - u) <= act Selu v - act Selu u <= c * (v - u)) as Right'
        by (intros u v Hu Huv; rewrite selu_right by auto; split; apply Rmult_le_compat_r; lra).
      destruct (Rle_lt_dec y 0); [now apply Left'|]. destruct (Rle_lt_dec 0 x); [now apply Right'|].
      pose proof (Left' x 0 L1 ltac:(lra) ltac:(lra)). pose proof (Right' 0 y ltac:(lra) ltac:(lra)). lra.
    + pose proof (inside_ends _ _ (V (snd i) P)) as H. apply not_positive_real in P.
      destruct (Left x y L1 L ltac:(lra)) as [D1 D2]. pose proof (exp_rises y (real (snd i)) L2).
      assert (k * exp y <= k * exp (real (snd i))) by (apply Rmult_le_compat_l; lra). split; nra.
Qed.

(** SiLU: its derivative s + x s (1 - s), s = sigmoid x, has the derivative - s (1 - s) w, w = x (2 s - 1) - 2, which
    rises with |x|. *)
Definition silu_bend (x : R) : R := x * (2 * sigmoid x - 1) - 2.
Lemma sigmoid_between x : 0 < sigmoid x < 1.
Proof.
  rewrite sigmoid_exp. pose proof (exp_pos x).
  split; [apply Rdiv_lt_0_compat; lra|]. apply (Rmult_lt_reg_r (1 + exp x)); [lra|].
  unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra.
Qed.
Lemma sigmoid_slope_product x : sigmoid_slope x = sigmoid x * (1 - sigmoid x).
Proof. rewrite sigmoid_slope_any. unfold bump, sigmoid. pose proof (exp_pos (- x)). field. lra. Qed.
Lemma sigmoid_opposite x : sigmoid (- x) = 1 - sigmoid x.
Proof.
  rewrite (sigmoid_exp (- x)). unfold sigmoid. pose proof (exp_pos (- x)). field. lra.
Qed.
Lemma silu_slope_sum x : silu_slope x = sigmoid x + x * sigmoid_slope x.
Proof.
  rewrite sigmoid_slope_any. unfold silu_slope, bump, sigmoid, Rsqr. pose proof (exp_pos (- x)). field. lra.
Qed.
Lemma silu_slope_opposite x : silu_slope (- x) = 1 - silu_slope x.
Proof. rewrite !silu_slope_sum, !sigmoid_slope_product, sigmoid_opposite. ring. Qed.
Lemma silu_slope_derivative x : derivable_pt_lim silu_slope x (- (sigmoid_slope x * silu_bend x)).
Proof.
  apply (derivable_pt_lim_ext (fun x => sigmoid x + x * (sigmoid x * (1 - sigmoid x))));
    [intros z; now rewrite silu_slope_sum, sigmoid_slope_product|].
  pose proof (sigmoid_derivative x) as D. set (d := sigmoid_slope x) in *. set (s := sigmoid x) in *.
  replace (- (d * silu_bend x)) with (d + (1 * (s * (1 - s)) + x * (d * (1 - s) + s * (0 - d)))).
  - apply (derivable_pt_lim_plus sigmoid (fun x => x * (sigmoid x * (1 - sigmoid x)))); [exact D|].
    apply (derivable_pt_lim_mult id (fun x => sigmoid x * (1 - sigmoid x))); [apply derivable_pt_lim_id|].
    apply (derivable_pt_lim_mult sigmoid (fun x => 1 - sigmoid x)); [exact D|].
    apply (derivable_pt_lim_minus (fun _ => 1) sigmoid); [apply derivable_pt_lim_const|exact D].
  - unfold silu_bend. fold s. unfold d. rewrite sigmoid_slope_product. fold s. ring.
Qed.
Lemma sigmoid_slope_positive x : 0 <= sigmoid_slope x.
Proof. rewrite sigmoid_slope_product. pose proof (sigmoid_between x). nra. Qed.
Lemma silu_bend_size x : silu_bend x = silu_bend (Rabs x).
Proof.
  destruct (Rle_lt_dec 0 x); [now rewrite Rabs_pos_eq|]. rewrite Rabs_left by auto. unfold silu_bend.
  rewrite sigmoid_opposite. ring.
Qed.
Lemma silu_bend_rises x y : Rabs x <= Rabs y -> silu_bend x <= silu_bend y.
Proof.
  rewrite (silu_bend_size x), (silu_bend_size y). pose proof (Rabs_pos x) as P. generalize dependent (Rabs y).
  generalize dependent (Rabs x). clear. intros x P y L. unfold silu_bend. pose proof (sigmoid_rises x y L).
  pose proof (sigmoid_rises 0 x P) as Z. assert (sigmoid 0 = / 2) as E.
  { unfold sigmoid. rewrite Ropp_0, exp_0. field. }
  rewrite E in Z. assert (x * (2 * sigmoid x - 1) <= y * (2 * sigmoid y - 1)); [|lra]. apply Rmult_le_compat; lra.
Qed.
(** A derivative that rises where `bend` is negative, and falls elsewhere. *)
Section Bent.
Context (slope weight bend : R -> R) (derivative : forall x, derivable_pt_lim slope x (- (weight x * bend x)))
  (positive : forall x, 0 <= weight x) (bend_rises : forall x y, Rabs x <= Rabs y -> bend x <= bend y).
Lemma slope_rises x y : x <= y -> (forall c, x <= c <= y -> bend c <= 0) -> slope x <= slope y.
Proof.
  intros L H. enough (0 * (y - x) <= slope y - slope x) by lra.
  apply (at_least_the_derivative _ (fun x => - (weight x * bend x))); auto. intros c Hc.
  split; [apply derivative|]. specialize (H c Hc). pose proof (positive c). nra.
Qed.
Lemma slope_falls x y : x <= y -> (forall c, x <= c <= y -> 0 <= bend c) -> slope y <= slope x.
Proof.
  intros L H. enough (slope y - slope x <= 0 * (y - x)) by lra.
  apply (at_most_the_derivative _ (fun x => - (weight x * bend x))); auto. intros c Hc.
  split; [apply derivative|]. specialize (H c Hc). pose proof (positive c). nra.
Qed.
(** Between l and h, where the place of the maximum, between p and q, is not. *)
Lemma slope_at_ends p q l h c : 0 <= p <= q -> bend p <= 0 -> 0 <= bend q -> l <= c <= h ->
  q < l \/ h < p -> slope c <= Rmax (slope l) (slope h).
Proof.
  intros O P Q C A. pose proof (Rmax_l (slope l) (slope h)). pose proof (Rmax_r (slope l) (slope h)).
  assert (forall z, Rabs z <= p -> bend z <= 0) as Inner.
  { intros z Hz. rewrite <- (Rabs_pos_eq p) in Hz by lra. pose proof (bend_rises z p Hz). lra. }
  assert (q < l -> slope c <= slope l) as Right.
  { intros G. apply slope_falls; [lra|]. intros z Hz.
    pose proof (bend_rises q z) as R. rewrite !Rabs_pos_eq in R by lra. specialize (R ltac:(lra)). lra. }
  destruct A as [A|A]; [specialize (Right A); lra|]. destruct (Rle_lt_dec (bend c) 0) as [B|B].
  - enough (slope c <= slope h) by lra. apply slope_rises; [lra|]. intros z Hz.
    destruct (Rle_lt_dec (Rabs z) p); [now apply Inner|].
    assert (Rabs z <= Rabs c) as S.
    { unfold Rabs in *. destruct (Rcase_abs z), (Rcase_abs c); lra. }
    pose proof (bend_rises z c S). lra.
  - enough (slope c <= slope l) by lra.
    assert (c < 0).
    { destruct (Rle_lt_dec 0 c); auto. pose proof (Inner c) as I. rewrite Rabs_pos_eq in I by auto.
      specialize (I ltac:(lra)). lra. }
    apply slope_falls; [lra|]. intros z Hz. pose proof (bend_rises c z) as R.
    rewrite !Rabs_left in R by lra. specialize (R ltac:(lra)). lra.
Qed.
End Bent.
Lemma silu_place_holds : let (p, q) := steepest_place Silu in
  0 <= real p <= real q /\ silu_bend (real p) <= 0 /\ 0 <= silu_bend (real q).
Proof.
  unfold steepest_place. pose proof (inside_ends _ _ (inside_sigmoid (4913, -11)%Z)) as [_ P].
  pose proof (inside_ends _ _ (inside_sigmoid (4914, -11)%Z)) as [Q _].
  assert (at_most (snd (sigmoidF (4913, -11)%Z), (-256)%Z) (15380435, -24)%Z = true) as A by (vm_compute; reflexivity).
  assert (at_most (15381059, -24)%Z (fst (sigmoidF (4914, -11)%Z), (-256)%Z) = true) as B by (vm_compute; reflexivity).
  apply at_most_real in A, B. generalize dependent (sigmoidF (4913, -11)%Z). intros u P A.
  generalize dependent (sigmoidF (4914, -11)%Z). intros v Q B. unfold silu_bend.
  rewrite !over_power in *. change (2 ^ 11)%Z with 2048%Z in *. change (2 ^ 24)%Z with 16777216%Z in *.
  set (s := sigmoid (4913 / 2048)) in *. set (t := sigmoid (4914 / 2048)) in *. clearbody s t. lra.
Qed.
Lemma gelu_place_holds : let (p, q) := steepest_place Gelu in
  0 <= real p <= real q /\ gelu_bend (real p) <= 0 /\ 0 <= gelu_bend (real q).
Proof.
  unfold steepest_place, gelu_bend. rewrite !over_power. change (2 ^ 8)%Z with 256%Z.
  change (2 ^ 12)%Z with 4096%Z. lra.
Qed.
Lemma inside_silu_slope t : inside (slope_at Silu t) (silu_slope (real t)).
Proof.
  rewrite silu_slope_sum. cbn [slope_at]. apply inside_add; [apply inside_sigmoid|].
  apply inside_mul; [apply inside_dyadic|apply inside_sigmoid_slope].
Qed.
(** Of functions with such a derivative, whose values at x and - x add up to 1. *)
Lemma bent_slopes_in a i slope weight bend : is_rising a = false ->
  (forall x, derivable_pt_lim (act a) x (slope x)) ->
  (forall x, derivable_pt_lim slope x (- (weight x * bend x))) -> (forall x, 0 <= weight x) ->
  (forall x y, Rabs x <= Rabs y -> bend x <= bend y) -> (forall x, slope (- x) = 1 - slope x) ->
  (forall x, real (fst (range_of a)) <= slope x <= real (steepest a)) ->
  (forall t, inside (slope_at a t) (slope (real t))) ->
  (let (p, q) := steepest_place a in 0 <= real p <= real q /\ bend (real p) <= 0 /\ 0 <= bend (real q)) ->
  slopes_in i (act a) (real (fst (derivatives a i))) (real (snd (derivatives a i))).
Proof.
  intros R Da D W B Opposite Range I S. pose proof (inside_ends _ _ (I (fst i))) as F.
  pose proof (inside_ends _ _ (I (snd i))) as G.
  assert (derivatives a i = let s := slope_at a (fst i) in let t := slope_at a (snd i) in
    let (p, q) := steepest_place a in
    (if below (neg p) (fst i) || below (snd i) (neg q)
     then smaller (fst s, (-256)%Z) (fst t, (-256)%Z) else fst (range_of a),
     if below q (fst i) || below (snd i) p
     then larger (snd s, (-256)%Z) (snd t, (-256)%Z) else steepest a)) as ->
    by (destruct a; try discriminate; reflexivity).
  cbv zeta. destruct (steepest_place a) as [p q]. destruct S as (O & P & Q).
  set (s := slope_at a (fst i)) in *. set (t := slope_at a (snd i)) in *. clearbody s t. cbn [fst snd].
  pose proof (slope_at_ends slope weight bend D W B) as Ends.
  assert (forall c, real (fst i) <= c <= real (snd i) ->
    real (if below (neg p) (fst i) || below (snd i) (neg q)
          then smaller (fst s, (-256)%Z) (fst t, (-256)%Z) else fst (range_of a)) <= slope c <=
    real (if below q (fst i) || below (snd i) p
          then larger (snd s, (-256)%Z) (snd t, (-256)%Z) else steepest a)) as Between.
  { intros c C. pose proof (Range c) as Rc. split.
    - destruct (below (neg p) (fst i) || below (snd i) (neg q)) eqn:E; [|lra].
      rewrite real_smaller. pose proof (Ends (real p) (real q) (- real (snd i)) (- real (fst i)) (- c) O P Q
        ltac:(lra)) as M. rewrite !Opposite in M.
      assert (real q < - real (snd i) \/ - real (fst i) < real p) as H.
      { apply orb_true_iff in E. destruct E as [E|E]; apply below_real in E; rewrite real_neg in E; lra. }
      specialize (M H). revert M. unfold Rmin, Rmax. destruct (Rle_dec _ _), (Rle_dec _ _); lra.
    - destruct (below q (fst i) || below (snd i) p) eqn:E; [|lra].
      rewrite real_larger. pose proof (Ends (real p) (real q) _ _ c O P Q C) as M.
      assert (real q < real (fst i) \/ real (snd i) < real p) as H
        by (apply orb_true_iff in E; destruct E as [E|E]; apply below_real in E; lra).
      specialize (M H). revert M. unfold Rmax. destruct (Rle_dec _ _), (Rle_dec _ _); lra. }
  set (lo := real (if _ || _ then smaller _ _ else _)) in *. set (hi := real (if _ || _ then larger _ _ else _)) in *.
  intros x y L1 L L2. split; [apply (at_least_the_derivative _ slope)|apply (at_most_the_derivative _ slope)];
    auto; intros c Hc; (split; [apply Da|]); apply Between; lra.
Qed.
Lemma silu_slopes_in i : slopes_in i (act Silu) (real (fst (derivatives Silu i))) (real (snd (derivatives Silu i))).
Proof.
  apply (bent_slopes_in Silu i silu_slope sigmoid_slope silu_bend eq_refl silu_derivative silu_slope_derivative
    sigmoid_slope_positive silu_bend_rises silu_slope_opposite); [|apply inside_silu_slope|apply silu_place_holds].
  intros x. pose proof (silu_slope_between x). unfold range_of. cbn [is_rising fst].
  rewrite real_add, real_neg, real_one, real_silu. lra.
Qed.
Lemma gelu_slopes_in i : slopes_in i (act Gelu) (real (fst (derivatives Gelu i))) (real (snd (derivatives Gelu i))).
Proof.
  apply (bent_slopes_in Gelu i gelu_derivative_at gelu_weight gelu_bend eq_refl gelu_derivative_holds
    gelu_second_derivative gelu_weight_positive gelu_bend_rises gelu_derivative_opposite);
    [|apply inside_gelu_slope|apply gelu_place_holds].
  intros x. pose proof (gelu_slope_between (x / sqrt 2)). unfold range_of, gelu_derivative_at. cbn [is_rising fst].
  rewrite real_add, real_neg, real_one, real_gelu. lra.
Qed.

Theorem slopes_between_hold a i : is_entrywise a = true ->
  slopes_in i (act a) (real (fst (slopes_between a i))) (real (snd (slopes_between a i))).
Proof.
  intros E. apply (rounded_slopes a i (fst (derivatives a i)) (snd (derivatives a i)) E); [|apply surjective_pairing].
  destruct a; try discriminate; [| | | | | |apply silu_slopes_in|apply gelu_slopes_in]; cbn [derivatives fst snd act].
  - intros x y L1 L L2. cbn [act]. unfold relu. destruct (is_below_zero (fst i)) eqn:B, (is_positive (snd i)) eqn:P;
    cbn [orb negb];
      rewrite ?real_one, ?real_zero; unfold is_below_zero in B;
      [apply negb_true_iff, negative_real in B|apply negb_true_iff, negative_real in B
       |apply negb_false_iff, real_nonnegative in B|apply negb_false_iff, real_nonnegative in B];
      try apply not_positive_real in P; unfold Rmax; destruct (Rle_dec 0 x), (Rle_dec 0 y); lra.
  - apply tanh_slopes_in_sigmoid. intros x Hx. pose proof (sizes_between i x Hx) as [N F].
    set (n := nearest i) in *. set (f := farthest i) in *.
    cbn [slope_at]. pose proof (inside_mul _ _ _ _ inside_four (inside_sigmoid_slope (shift 1 n))) as A.
    pose proof (inside_mul _ _ _ _ inside_four (inside_sigmoid_slope (shift 1 f))) as B.
    apply inside_ends in A, B. rewrite real_shift in A, B. replace (powerRZ 2 1) with 2 in A, B by (simpl; ring).
    pose proof (sigmoid_slope_falls (2 * real n) (2 * x)) as C.
    pose proof (sigmoid_slope_falls (2 * x) (2 * real f)) as G.
    rewrite !Rabs_mult, (Rabs_pos_eq 2) in C, G by lra. specialize (C ltac:(lra)). specialize (G ltac:(lra)). lra.
  - apply sigmoid_slopes_in. intros x Hx. pose proof (sizes_between i x Hx) as [N F].
    set (n := nearest i) in *. set (f := farthest i) in *.
    cbn [slope_at]. pose proof (inside_ends _ _ (inside_sigmoid_slope n)) as A.
    pose proof (inside_ends _ _ (inside_sigmoid_slope f)) as B.
    pose proof (sigmoid_slope_falls (real n) x N). pose proof (sigmoid_slope_falls x (real f) F). lra.
  - cbn [slope_at]. apply (slopes_wider i softplus (sigmoid (real (fst i))) (sigmoid (real (snd i)))).
    + apply (inside_ends _ _ (inside_sigmoid (fst i))).
    + apply (inside_ends _ _ (inside_sigmoid (snd i))).
    + apply slopes_of_tangents; [intros; apply softplus_tangent|apply sigmoid_rises].
  - assert (forall t, inside (slope_at Elu t) (elu_slope (real t))) as K.
    { intros t. cbn [slope_at]. unfold elu_slope. destruct (is_positive t) eqn:P.
      - apply real_positive in P. destruct (Rlt_dec 0 (real t)); [apply inside_one|lra].
      - apply not_positive_real in P. destruct (Rlt_dec 0 (real t)); [lra|].
        pose proof (inside_exp_size t) as X. now rewrite Rabs_left1, Ropp_involutive in X. }
    apply (slopes_wider i (act Elu) (elu_slope (real (fst i))) (elu_slope (real (snd i)))).
    + apply (inside_ends _ _ (K (fst i))).
    + apply (inside_ends _ _ (K (snd i))).
    + apply slopes_of_tangents; [intros; apply elu_tangent|apply elu_slope_rises].
  - apply selu_slopes_in.
Qed.
